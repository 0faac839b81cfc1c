"""Finds tags frame after frame: measures known ones at predicted places, searches for others."""
