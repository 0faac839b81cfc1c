"""Overhead cameras: pictures of the city become the poses and tracks of its cars.

camera      the lens: pixels to rays and back; calibration: one that was measured
source      the contract of what gives frames; sources/ has each; picture: files that may be damaged
detect      finding tag36h11 tags in any frame; find/ the quick way for tags that are known
anchor, pose    the floor's tags correct the camera; a roof's tag gives a car's pose with covariance
sight       by which calibration a camera sees: put in force while it runs, put back, kept
watch       what is wrong with a camera, in words, while it runs
track/      one estimate per car over all cameras; roofs: where its tag should be next
calibrate/  `scm eye calibrate` and `scm eye locate`
render/     the city as seen from above, with truth: `scm eye render`
part        EyePart: a frame in; tags, poses, tracks, status and pictures out
"""
