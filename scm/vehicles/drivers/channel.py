"""The radio channel: whether a frame reaches a receiver over a distance, and how late.

    P(lost) = 1 - (1 - loss) (1 - P_link(d)) (1 - P_load)
    P_link  = Q(M / fading),   M(d) = 10 n log10(range / d) - wall_db * walls between    [dB]
    without fading: lost where M < 0, so beyond `range`; there is no edge before it
    delay   = delay_s + jitter_s * u,   u uniform in [0, 1)

n is the path loss exponent, Q the tail of the normal distribution: log-distance path loss with
log-normal fading, drawn anew for every frame and receiver, so shadows do not last (Rappaport,
Wireless Communications, 4.9). Half of the frames get lost at `range`.
Whether a frame is lost is a hash of numbers: the same in any order and on any thread.
"""

import math

import numpy as np

from scm.arrays import Bools, Floats
from scm.records.city_map import RadioChannel
from scm.vehicles.array_struct import ArrayStruct
from scm.vehicles.jit import array_kernel, kernel_function

WORDS = 4294967296.0  # number of values of a 32-bit word
NEAREST_M = 0.01
HISTORY_WHEN_LOSSY, MIN_CAM_INTERVAL_MS = 16, 100.0

# Columns of the numbers. IDEAL is 1 where every frame reaches every driver at once, POOR_RECEPTION
# where the only driver has found that it receives too little.
IDEAL, LOSS, RANGE, FADING, EXPONENT, WALL, DELAY_NS, JITTER_NS, POOR_RECEPTION = range(9)


class Channel(ArrayStruct):
    """A radio channel.

    Attributes:
        numbers: (9,) see the columns above.
        walls: (w, 4) both ends of each wall [m]; empty when walls do not attenuate.
        poses: (capacity, 4) of each receiver, x and y first [m].
        load: (capacity,) share of frames that each receiver loses to a busy channel.
    """

    numbers: Floats
    walls: Floats
    poses: Floats
    load: Floats


def channel_of(
    given: RadioChannel,
    range_m: float,
    capacity: int,
    walls: Floats,
) -> Channel:
    """Return the channel for a number of receivers."""
    segments = walls if given.wall_db > 0.0 else np.zeros((0, 4))
    numbers = [
        float(is_ideal(given)), given.loss, range_m, given.fading_db, given.path_loss_exponent,
        given.wall_db, 1e6 * given.delay_ms, 1e6 * given.jitter_ms,
        0.0,
    ]  # fmt: skip
    return Channel(np.array(numbers), segments, np.zeros((capacity, 4)), np.zeros(capacity))


def ideal() -> Channel:
    """Return an ideal channel, for a receiver that is given its frames."""
    return channel_of(RadioChannel(), math.inf, 0, np.zeros((0, 4)))


def is_ideal(given: RadioChannel) -> bool:
    """Return whether every frame reaches every driver at once."""
    harm = (given.loss, given.fading_db, given.wall_db, given.delay_ms, given.jitter_ms)
    return not any(harm) and not given.hidden_share and given.range_m is None


def history_length(given: RadioChannel) -> int:
    """Return how many frames of a sender are stored, so that late and lost ones are covered."""
    if is_ideal(given):
        return 1
    return HISTORY_WHEN_LOSSY + math.ceil((given.delay_ms + given.jitter_ms) / MIN_CAM_INTERVAL_MS)


@kernel_function
def pcg_hash(a: int, b: int) -> int:
    """Return a 32-bit hash of two numbers (PCG, O'Neill 2014)."""
    state = ((a & 0xFFFFFFFF) * 747796405 + (b & 0xFFFFFFFF) * 277803737 + 2891336453) & 0xFFFFFFFF
    word = (((state >> ((state >> 28) + 4)) ^ state) * 277803737) & 0xFFFFFFFF
    return (word >> 22) ^ word


@kernel_function
def sides(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the side of the line from a to b on which a point lies, + = left."""
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@kernel_function
def walls_between(walls: Floats, x0: float, y0: float, x1: float, y1: float) -> int:
    """Return the number of walls that a straight line crosses."""
    count = 0
    for at in range(len(walls)):
        ax, ay, bx, by = walls[at, 0], walls[at, 1], walls[at, 2], walls[at, 3]
        ends = sides(ax, ay, x0, y0, x1, y1) * sides(bx, by, x0, y0, x1, y1)
        if ends < 0.0 and sides(x0, y0, ax, ay, bx, by) * sides(x1, y1, ax, ay, bx, by) < 0.0:
            count += 1
    return count


@kernel_function
def link_loss(numbers: Floats, walls: Floats, x0: float, y0: float, x1: float, y1: float) -> float:
    """Return the share of frames lost between two places."""
    distance = math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    shadows = walls_between(walls, x0, y0, x1, y1)
    if numbers[FADING] <= 0.0 and shadows == 0:
        return 0.0 if distance <= numbers[RANGE] else 1.0
    ratio = numbers[RANGE] / max(distance, NEAREST_M)
    margin = 10.0 * numbers[EXPONENT] * math.log10(ratio) - numbers[WALL] * shadows
    if numbers[FADING] <= 0.0:
        return 0.0 if margin >= 0.0 else 1.0
    return 0.5 * math.erfc(margin / (numbers[FADING] * math.sqrt(2.0)))


@kernel_function
def has_arrived(
    channel: Channel,
    seed: int,
    sender: int,
    receiver: int,
    frame: int,
    x: float,
    y: float,
    age_ns: int,
) -> bool:
    """Return whether a frame sent some time ago has reached a receiver by now.

    Uses the receiver's present place, not that at the time of sending.
    """
    numbers = channel.numbers
    here = channel.poses[receiver]
    link = link_loss(numbers, channel.walls, x, y, here[0], here[1])
    load = channel.load[receiver]
    lost = numbers[LOSS] + (1.0 - numbers[LOSS]) * (link + (1.0 - link) * load)
    draw = pcg_hash(pcg_hash(seed, sender), pcg_hash(receiver, frame))
    if draw < lost * WORDS:
        return False
    due = numbers[DELAY_NS] + numbers[JITTER_NS] * (pcg_hash(draw, frame) / WORDS)
    return bool(age_ns >= due)


@array_kernel
def link_losses(
    numbers: Floats, walls: Floats, x: Floats, y: Floats, to_x: Floats, to_y: Floats, out: Floats
) -> None:
    """Write the loss from places (k,) to places (n,) to `out` (k, n)."""
    for row in range(len(x)):
        for column in range(len(to_x)):
            out[row, column] = link_loss(numbers, walls, x[row], y[row], to_x[column], to_y[column])


@array_kernel
def add_busy_time(
    sense_m: float,
    sent_x: Floats,
    sent_y: Floats,
    air_s: Floats,
    x: Floats,
    y: Floats,
    selected: Bools,
    out: Floats,
) -> None:
    """Write how long the frames (k,) occupy the channel at each selected place (n,) [s]."""
    for place in range(len(x)):
        out[place] = 0.0
        if not selected[place]:
            continue
        for frame in range(len(sent_x)):
            dx, dy = sent_x[frame] - x[place], sent_y[frame] - y[place]
            if dx * dx + dy * dy <= sense_m * sense_m:
                out[place] += air_s[frame]
