"""Selects the effects that explain recordings: one at a time, or several where a car is far off."""
