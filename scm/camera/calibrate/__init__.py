"""`scm camera calibrate-look`: a car file whose rendered camera looks like a real one.

real_frames    the folder of frames, and what makes it useless
counterparts   the same camera's rendered frames, from places that look alike
measures       colour, noise and sharpness of frames
fit            the look that makes both equal; the car file that has it
"""
