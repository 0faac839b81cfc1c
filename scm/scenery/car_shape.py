"""The shape of a car above its wheels, after the measures of its file."""

import math

import numpy as np

from scm.arrays import Floats
from scm.scenery.bodies import CarBody
from scm.scenery.canvas import Colour
from scm.scenery.solids import Solid, prism, rectangle
from scm.scenery.tags import PRINT_SCALE

RUBBER: Colour = (30, 30, 32)
GLASS: Colour = (74, 62, 52)
BLACK: Colour = (24, 24, 26)
LAMP: Colour = (214, 240, 246)
TAIL: Colour = (44, 36, 150)


def shell_of(body: CarBody, colour: Colour) -> tuple[Solid, ...]:
    """Everything but the wheels, from the floor up."""
    rear, front = body.x_span
    half = body.y_span[1]
    tag_x, _, roof = body.tag_position
    plate = body.tag_size * PRINT_SCALE
    inner = 0.78 * half
    nose = front - 0.016
    dark: Colour = (colour[0] * 2 // 3, colour[1] * 2 // 3, colour[2] * 2 // 3)
    deck = 0.62 * roof
    puck_x = min(front - 0.05, tag_x + plate / 2 + 0.062)
    angles = np.linspace(0.0, 2.0 * math.pi, 14, endpoint=False)
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    cabin_front = tag_x + plate / 2 + 0.03
    cabin = rounded(tag_x - plate / 2 - 0.012, cabin_front, -inner * 0.86, inner * 0.86, 0.012)
    return (
        prism(rectangle(front - 0.008, 0.0, 0.016, 1.8 * half), 0.02, 0.05, BLACK),
        prism(rectangle(rear + 0.008, 0.0, 0.016, 1.7 * half), 0.02, 0.05, BLACK),
        prism(rounded(rear, front - 0.006, -inner, inner, 0.022), 0.02, deck, colour, taper=0.04),
        prism(
            rectangle((puck_x + nose) / 2, 0.0, nose - puck_x, 0.5 * inner),
            deck,
            deck + 0.002,
            dark,
        ),
        *(
            prism(rectangle(nose - 0.012, s * 0.68 * inner, 0.014, 0.024), deck, deck + 0.001, LAMP)
            for s in (1.0, -1.0)
        ),
        *(
            prism(rectangle(rear + 0.016, s * 0.68 * inner, 0.01, 0.03), deck, deck + 0.001, TAIL)
            for s in (1.0, -1.0)
        ),
        prism(cabin, deck, roof - 0.006, GLASS, taper=0.1),
        prism(
            rectangle(tag_x, 0.0, plate + 0.006, plate + 0.006), roof - 0.006, roof - 0.0005, dark
        ),
        prism(ring * 0.026 + (puck_x, 0.0), deck, roof + 0.012, BLACK),
        prism(ring * 0.03 + (puck_x, 0.0), roof + 0.014, roof + 0.032, (52, 50, 48)),
    )


def rounded(x0: float, x1: float, y0: float, y1: float, cut: float) -> Floats:
    """Return a rectangle whose corners are cut off, counter-clockwise, (8, 2)."""
    return np.array(
        [
            [x0 + cut, y0], [x1 - cut, y0], [x1, y0 + cut], [x1, y1 - cut],
            [x1 - cut, y1], [x0 + cut, y1], [x0, y1 - cut], [x0, y0 + cut],
        ]
    )  # fmt: skip
