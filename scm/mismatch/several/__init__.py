"""Diagnoses several cars and finds the effects that they share."""
