"""A demonstration before it is learned from, as one HTML file that loads nothing.

How it was driven, lap by lap; how often each steering command occurs, before and after balancing;
and frames beside what augmentation makes of them, with their commands.
"""

import base64
import statistics
from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from scm.arrays import Bools, Floats, Image
from scm.camera.optics import optics_of
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import LearningError
from scm.maps.svg import element
from scm.mismatch.report.page import around, document, figure, section, table, tag
from scm.mismatch.report.plot import Picture, band, frame, grid, legend, line, picture_svg
from scm.vehicles.car import Car
from vehicle_agent.autonomy.plan import limits_of
from vehicle_agent.cloning.augmentation import Augmentation, Augmenter
from vehicle_agent.cloning.demonstration import Demonstration, Sample
from vehicle_agent.cloning.training import (
    HELD_OUT,
    MOVING_MPS,
    STRAIGHT,
    STRAIGHT_SHARE,
    Recipe,
    balanced,
)

SIZE = 1060.0, 300.0
BINS = np.linspace(-1.0, 1.0, 41)  # as wide as what balancing thins out is on either side
SHOWN, CHANGED = 6, 3  # frames, and changed ones beside each
JPEG_QUALITY = 80
BAR = 200.0, 14.0
SIDE_BY_SIDE = (
    "display:grid;grid-template-columns:repeat(auto-fit,minmax(min(45%,150px),1fr));gap:0 16px"
)


def demonstration_page(demonstration: Demonstration, car: Car, seed: int = 0) -> str:
    """Return the page.

    Args:
        demonstration: What is shown.
        car: The file of the car that was driven.
        seed: Of balancing and augmentation; `train` leaves out the same frames with it.

    Raises:
        LearningError: when the car never moved, or a frame is missing.
        CarError: when the car file lacks a camera.
    """
    moving = [one for one in demonstration.samples if abs(one.speed_mps) > MOVING_MPS]
    if not moving:
        msg = f"expected frames of a car that moves, got {len(demonstration.samples)} while it"
        raise LearningError(f"{demonstration.path}: {msg} stands: did it drive?")
    rng, how = np.random.default_rng(seed), Recipe().how
    steering = np.array([one.steering for one in moving])
    stays = balanced(steering, rng)
    body = (
        _head(demonstration, moving)
        + section("laps", "Laps", _laps(demonstration, moving), _over_time(moving))
        + section("balancing", "Balancing", *_balancing(steering, stays))
        + section("augmentation", "Augmentation", *_augmented(demonstration, moving, car, how, rng))
    )
    return document(f"{demonstration.path.name}: a demonstration", body)


def _head(demonstration: Demonstration, moving: Sequence[Sample]) -> str:
    about, samples = demonstration.about, demonstration.samples
    delays_ms = [(one.arrived_ns - one.t_ns) / NS_PER_MS for one in samples]
    speed_mps = statistics.fmean(one.speed_mps for one in moving)
    laps = f"{about.laps} lap{'s' * (about.laps != 1)}"
    title = f"{laps} of {about.vehicle} on {about.map}: {len(samples)} frames"
    late_ms = float(np.quantile(delays_ms, 0.95))
    words = (
        f"{len(moving)} of {len(samples)} frames were taken while the car moved, at "
        f"{speed_mps:.2f} m/s on average; others teach nothing about steering. A frame arrived "
        f"{statistics.median(delays_ms):.0f} ms after its exposure (median; 95 % within "
        f"{late_ms:.0f} ms): the command beside it is the one of its arrival."
    )
    size = f"frames of {about.width_px} x {about.height_px} px"
    inner = tag("p", f"{demonstration.path}, car file {about.car}, {size}", "inputs")
    inner += tag("h1", title) + tag("p", words)
    return around("header", around("div", inner, "words"), "verdict none")


def _laps(demonstration: Demonstration, moving: Sequence[Sample]) -> str:
    """Return a row for each lap, the last of which may be unfinished."""
    last = max(one.lap for one in moving)
    rows = []
    for lap in sorted({one.lap for one in moving}):
        own = [one for one in moving if one.lap == lap]
        is_held = "held out" if lap == last and last else ""
        finished = is_held if lap < demonstration.about.laps else f"not finished {is_held}"
        rows.append([
            str(lap + 1), str(len(own)), f"{(own[-1].t_ns - own[0].t_ns) / NS_PER_S:.1f}",
            f"{statistics.fmean(one.speed_mps for one in own):.3f}",
            f"{statistics.fmean(abs(one.steering) for one in own):.3f}", finished.strip(),
        ])  # fmt: skip
    text = f"Of one lap, the last {100 * HELD_OUT:.0f} % of the frames are held out."
    head = ("lap", "frames", "time [s]", "speed [m/s]", "mean |steering|", "")
    return table(head, rows, range(5)) + ("" if last else tag("p", text))


def _over_time(moving: Sequence[Sample]) -> str:
    t_s = np.array([(one.t_ns - moving[0].t_ns) / NS_PER_S for one in moving])
    of = frame((0.0, float(t_s[-1])), (-1.05, 1.05), SIZE)
    steering = np.array([one.steering for one in moving])
    steering[np.flatnonzero(np.diff(t_s) > 1.0)] = np.nan  # it stood meanwhile
    parts = [*grid(of, "time [s]", "steering, + = left"), line(of, t_s, steering, "after thin")]
    caption = "Keys steer all or nothing: a gamepad gives the network finer examples."
    return _wide("Steering over time", caption, parts)


def _balancing(steering: Floats, stays: Bools) -> Iterator[str]:
    yield tag(
        "p",
        f"{stays.sum()} of {len(steering)} frames stay: of those that steer by less than "
        f"{STRAIGHT:g}, {100 * STRAIGHT_SHARE:.0f} %. On most maps they are so many that a "
        "network learns little but to go straight on.",
    )
    before, after = (np.histogram(one, BINS)[0] for one in (steering, steering[stays]))
    of = frame((-1.0, 1.0), (0.0, 1.08 * float(before.max())), SIZE)
    edges = np.repeat(BINS, 2)
    (x, high), low = (edges, _steps(after)), np.zeros(len(edges))
    parts = [
        *grid(of, "steering, + = left", "frames"),
        band(of, x, low, high, "band-after"),
        line(of, x, high, "after"),
        line(of, x, _steps(before), "before"),
        *legend(of.left + 12, of.top - 8, (("before", "before balancing"), ("after", "after"))),
    ]
    caption = "A balanced drive is about as high on the left as on the right; mirroring evens it."
    yield _wide("How often each steering command occurs", caption, parts)


def _wide(title: str, caption: str, parts: Sequence[str]) -> str:
    svg = picture_svg(*SIZE, parts, title)
    return figure(Picture(name="", title=title, caption=caption, svg=svg, wide=True))


def _steps(counts: Floats) -> Floats:
    """Return the heights of a histogram's outline, two at each edge."""
    return np.concatenate(([0.0], np.repeat(counts, 2), [0.0]))


def _augmented(
    demonstration: Demonstration, moving: Sequence[Sample], car: Car, how: Augmentation,
    rng: np.random.Generator,
) -> Iterator[str]:  # fmt: skip
    """Yield frames from those that steer farthest right to farthest left, and changed ones."""
    yield tag(
        "p",
        f"Every epoch changes each frame anew: seen from beside the way ({how.offset_std_m:g} m "
        f"and {how.heading_std_rad:g} rad, standard deviations), with the command that leads back; "
        f"mirrored, {100 * how.mirrored:.0f} %; light {how.light[0]:g} to {how.light[1]:g} times; "
        f"a shadow, {100 * how.shadow:.0f} %. Bar and number: the steering command; thin: before.",
    )
    ordered = sorted(moving, key=lambda one: one.steering)
    chosen = np.unique(np.linspace(0, len(ordered) - 1, SHOWN).round().astype(int))
    first = demonstration.frame(ordered[0])
    size = first.shape[1], first.shape[0]
    augment = Augmenter(optics_of(car, "front"), limits_of(car), size, how, rng)
    for sample in (ordered[number] for number in chosen):
        original = demonstration.frame(sample)
        figures = _shown(original, sample.frame, sample.steering, sample.steering)
        for _ in range(CHANGED):
            (changed,), steering = augment([original], sample.steering)
            figures += _shown(changed, "changed", steering, sample.steering)
        yield f'<div style="{SIDE_BY_SIDE}">{figures}</div>'


def _shown(image: Image, name: str, steering: float, before: float) -> str:
    """Return a picture with the command that belongs to it, and the one before the change."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    address = "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
    text = f"{name}: {_signed(steering)}"
    picture = f'<img src="{address}" alt="{text}" style="width:100%;display:block">'
    width, height = BAR
    middle, reach = 0.5 * width, 0.5 * width - 2.0
    bar, thin = middle - reach * steering, middle - reach * before  # left is left
    parts = [
        element("path", d=f"M{middle:.1f} 0V{height:g}", class_="zero"),
        element(
            "rect", x=f"{min(middle, bar):.1f}", y="3", width=f"{abs(bar - middle):.1f}",
            height="8", class_="bar-after",
        ),
        element("path", d=f"M{thin:.1f} 0V{height:g}", class_="needed"),
    ]  # fmt: skip
    svg = around("div", picture_svg(width, height, parts, text), "canvas")
    return around("figure", picture + svg + tag("figcaption", text))


def _signed(value: float) -> str:
    return f"{value:+.2f}".replace("-", "\N{MINUS SIGN}")
