"""Renders the city as the overhead camera sees it.

floor       static scenery: ground, roads, paint, walls and boxes, drawn once
car         a car with its wheels, shadow and roof tag
"""
