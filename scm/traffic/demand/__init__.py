"""Demand: cars that enter, drive and leave as a table or a SUMO route file says."""
