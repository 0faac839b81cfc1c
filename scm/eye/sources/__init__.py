"""Sources of frames; `choose` creates one from the command line's text.

`synthetic` renders the world; `file` and `folder` play recorded frames; `bus` receives frames;
`live` reads a camera that `device` or `mjpeg` opens, and `frame_monitor` checks its frames.
"""
