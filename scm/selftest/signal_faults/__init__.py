"""What can be wrong with signals: one module a fault, its constant is `FAULT`."""
