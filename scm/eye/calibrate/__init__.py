"""Measuring a lens, and where a camera is mounted.

board       finding the printed board in a picture
gather      views of the board from pictures, a film or a live camera
solve       the lens that fits the views best, without outliers, and its covariance
assessment  whether the views determine a lens; which further views would
summary     the result in words, with a map of the frame
report      the result as plain data
locate      the camera's pose from tags whose places on the map are known
"""
