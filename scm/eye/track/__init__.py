"""One estimate per car, from the sightings of one or several cameras.

sighting    what a camera says of a car, and what is told of a track
motion      how cars move between sightings
fleet       all tracks as arrays
update      a frame of sightings taken in: gates, jumps, doubles
tracks      late sightings put in their place; tracks told at any time
perception  tracks as a collective perception message
"""
