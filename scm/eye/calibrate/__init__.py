"""Measuring a lens, and where a camera hangs.

board     what was printed, and finding it in a picture
gather    views of the board out of pictures, a film or a live camera
solve     the lens that fits the views best, without blunders, and how sure it is
judge     whether the views can tell a lens at all; which further ones would
say       all that in words, with a map of the frame
locate    the camera's pose from tags whose places on the map are known
"""
