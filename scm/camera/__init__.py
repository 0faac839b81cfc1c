"""The cars' own cameras: what a front or rear camera sees of the city, rendered on demand.

optics, lens        what a car file says of a camera; the pinhole, its view and its distortion
floor, standing, car_mesh   what is to be seen: the map's flat picture, walls and heads, other cars
mesh, painter       flat faces in painter's order, cut before the lens, shaded by daylight
sensor, studio, part        noise; one whole picture; the part that makes them while somebody asks
"""
