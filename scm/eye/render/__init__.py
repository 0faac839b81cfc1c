"""Drawing the city as the overhead camera sees it.

floor       what lies still: ground, roads, paint, walls and boxes, drawn once
car         the shape of a car with its wheels, shadow and roof tag
"""
