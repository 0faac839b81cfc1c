"""Ways in which signals can fail: one module per fault, with a constant `FAULT`."""
