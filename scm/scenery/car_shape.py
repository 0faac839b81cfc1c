"""The shape of a car above its wheels, from the dimensions in its file."""

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
LAMP: Colour = (172, 186, 190)
LAMP_ON: Colour = (225, 252, 255)
TAIL: Colour = (40, 32, 112)
TAIL_ON: Colour = (44, 36, 172)
BRAKE: Colour = (60, 50, 255)
AMBER: Colour = (30, 168, 255)


def shell_of(
    body: CarBody, colour: Colour, lamps: frozenset[str] = frozenset()
) -> tuple[Solid, ...]:
    """Return everything but the wheels, from the floor up: bumpers, shell, lamps, cabin, sensors.

    Args:
        body: Its measures.
        colour: Its paint.
        lamps: Names of those that are on, as `VehicleState` has them.
    """
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
        *_lamps(nose, rear, inner, deck, lamps),
        prism(cabin, deck, roof - 0.006, GLASS, taper=0.1),
        prism(
            rectangle(tag_x, 0.0, plate + 0.006, plate + 0.006), roof - 0.006, roof - 0.0005, dark
        ),
        prism(ring * 0.026 + (puck_x, 0.0), deck, roof + 0.012, BLACK),
        prism(ring * 0.03 + (puck_x, 0.0), roof + 0.014, roof + 0.032, (52, 50, 48)),
    )


def _lamps(
    nose: float, rear: float, inner: float, deck: float, lamps: frozenset[str]
) -> list[Solid]:
    """Return what is seen of the lamps from above: strips on the deck."""
    head = LAMP_ON if "head_low" in lamps else LAMP
    tail = BRAKE if "brake" in lamps else TAIL_ON if "tail" in lamps else TAIL

    def strip(x: float, y: float, length: float, width: float, colour: Colour) -> Solid:
        return prism(rectangle(x, y, length, width), deck, deck + 0.001, colour)

    strips = []
    for side, name in ((1.0, "left"), (-1.0, "right")):
        strips.append(strip(nose - 0.012, side * 0.68 * inner, 0.014, 0.024, head))
        strips.append(strip(rear + 0.016, side * 0.68 * inner, 0.01, 0.03, tail))
        if name in lamps:
            strips += [strip(x, side * 0.9 * inner, 0.02, 0.02, AMBER) for x in (nose, rear + 0.02)]
    if "reverse" in lamps:
        strips += [strip(rear + 0.016, s * 0.3 * inner, 0.01, 0.016, LAMP_ON) for s in (1.0, -1.0)]
    return strips


def rounded(x0: float, x1: float, y0: float, y1: float, cut: float) -> Floats:
    """Return a rectangle whose corners are cut off, counter-clockwise, (8, 2)."""
    return np.array(
        [
            [x0 + cut, y0], [x1 - cut, y0], [x1, y0 + cut], [x1, y1 - cut],
            [x1 - cut, y1], [x0 + cut, y1], [x0, y1 - cut], [x0, y0 + cut],
        ]
    )  # fmt: skip
