"""The signal monitor: a second channel that checks what signals show, without their code."""
