"""The signal monitor: a second channel that checks what signals show and shares no code with them."""
