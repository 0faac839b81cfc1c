"""The unchanged Nigel firmware on a pseudo-terminal, and the simulated car that it moves."""
