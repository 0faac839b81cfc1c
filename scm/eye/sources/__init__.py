"""Where frames come from; `choose` turns what a person types into one of them.

`synthetic` renders the world; `file` and `folder` play what was taken before; `bus` hears frames;
`live` reads a camera that `device` or `mjpeg` opens, and `watch` checks what comes of it.
"""
