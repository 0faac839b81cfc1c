"""The appearance of a city, for everything that renders it: the Eye above and cameras on cars.

board, prints   boards and tags at true size; paper: pages of them as PDF or SVG
sheet       the floor as one flat picture: ground, roads, paint
solids, canvas      prisms shaded by the light, and smooth polygons on a frame
bodies, tags        a car's outline from its file, and the tag on its roof
"""
