"""Drawing the city as the overhead camera sees it.

canvas      a supersampled window onto a frame: polygons and tags in pixels, smooth edges
solids      prisms and frustums through the lens, far sides hidden, near ones shaded
floor       what lies still: ground, roads, paint, walls and boxes, drawn once
car         the shape of a car with its wheels, shadow and roof tag
"""
