"""What a city looks like, for whoever draws it through a lens: the Eye above, cameras on cars.

board, prints   boards and tags at true size; paper: pages of them as PDF or SVG
sheet       the floor as one flat picture: ground, roads, paint
solids, canvas      prisms shaded by the light, and smooth polygons on a frame
bodies, tags        a car's outline as its file says, and the print on its roof
"""
