"""Validates what was selected, on data that no fit has seen, and prepares what a report states."""
