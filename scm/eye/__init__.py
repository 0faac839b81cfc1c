"""Overhead camera: a picture of the city becomes the poses of its cars.

camera      the lens: pixels to rays and back; source: where frames come from (sources/ has each)
tags, detect    what a tag36h11 tag looks like, and finding them in a frame
anchor, pose    the floor's tag corrects the camera; each car's tag gives its pose with covariance
bodies      where a car carries its tag, and its outline; render/ draws the city as seen from above
part        EyePart: a snapshot's light in; tags, poses and frames out
"""
