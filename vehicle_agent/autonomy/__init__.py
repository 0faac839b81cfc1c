"""Driving without a hand: odometry, mapping, localisation, planning and control, a file a stage.

Each stage is usable alone and can be replaced: it takes and returns plain records, knows neither
the bus nor the truth, and its heavy loops are compiled.
"""
