"""Overhead camera: a picture of the city becomes the poses of its cars.

camera      the lens: pixels to rays and back; source: where frames come from (sources/ has each)
detect      finding tag36h11 tags in a frame
anchor, pose    the floor's tag corrects the camera; each car's tag gives its pose with covariance
render/     the city as seen from above
part        EyePart: a snapshot's light in; tags, poses and frames out
"""
