"""Overhead cameras: pictures of the city become the poses and tracks of its cars.

camera             the lens: pixels to rays and back; calibration: a measured lens
source             the contract of a source of frames; sources/ has each; picture: image files
detect             finds tag36h11 tags in any frame; find/ the fast way for known tags
extrinsics, pose   the map's tags correct the camera; a roof tag gives a car's pose and covariance
calibration_state  the calibration in force: changed while running, reverted, persisted
camera_monitor     what is wrong with a camera, in words, while it runs
track/             one estimate per car over all cameras; roofs: where its tag should be next
calibrate/         `scm eye calibrate` and `scm eye locate`
render/            the city as seen from above, with ground truth: `scm eye render`
part               EyePart: a frame in; tags, poses, tracks, status and pictures out
"""
