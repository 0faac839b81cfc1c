"""One estimate per car, from the sightings of one or several cameras.

sighting    a camera's pose of a car, and a car's track
motion      how cars move between sightings
fleet       all tracks as arrays
update      a frame of sightings processed: gates, jumps, duplicates
tracks      late sightings inserted in order; tracks evaluated at any time
perception  tracks as a collective perception message
"""
