"""Proofs by exhaustive search: the kernel is safe, plans hold, everybody is served."""
