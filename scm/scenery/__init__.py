"""What a city looks like, for whoever draws it through a lens: the Eye above, cameras on cars.

sheet       the floor as one flat picture: ground, roads, paint
solids, canvas      prisms shaded by the light, and smooth polygons on a frame
bodies, tags        a car's outline as its file says, and the print on its roof
"""
