"""The cars' own cameras: front and rear, rendered only for subscribers.

optics, lens        the camera's parameters in a car file; pinhole projection and distortion
floor, standing, car_mesh   the scene: the map's floor, walls and signal heads, other cars
mesh, painter       flat faces in painter's order, clipped at the near plane, shaded by daylight
sensor, studio, part        noise; rendering of one picture; the part that publishes pictures
batch               small grey pictures from many cars at once, for training
"""
