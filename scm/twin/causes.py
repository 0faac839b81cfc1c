"""Whose change is it: a car's, its tag's, the floor's at a place, a camera's, or everything's?

A number of a known effect changed by `d` moves the score of each window that is affected by `d`
times its information (`detector`). Which windows those are differs: all of one car since then, or
those of all cars at one place, under one camera, or anywhere. Each such hypothesis is a regression
of the scores of all cars over what each strayed nearby before, since no car file need be right.
What it explains, as a logarithm of evidence, is averaged over the numbers that it can be and over
the places where it can be, so that a hypothesis pays for what it leaves open.

Only one car drove since then: nothing tells its change from everything's. Then the probabilities
remain as they were, and what would decide is another car, or this one elsewhere.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from scm.arrays import Bools, Floats
from scm.clock import seconds
from scm.records.twins import Kind, TwinCause, TwinChange
from scm.twin.drives import Reaches, anywhere, deciding_drive, drive_in_words, next_drive
from scm.twin.evidence import OWN, Witness
from scm.twin.places import EFFECTS, PlaceWatch
from scm.twin.windows import EVERY_S, WatchedNumber

PRIOR = {"car": 0.45, "tag": 0.1, "place": 0.2, "camera": 0.1, "everywhere": 0.15}
SELDOM = math.log(0.25)  # a car's change that shows at one place only, as where it brakes
SURE, POSSIBLE, NEAR = 0.9, 0.1, 0.01  # probabilities; nearer than that are the same
IsOff = Callable[[Floats], Bools]
ELSEWHERE: tuple[Kind, ...] = ("place", "camera")
OF_TAGS = ("pose_point", "pose_heading")
OF_CAMERAS = ("camera_tilt", "pose_scale", "pose_latency", "clock_offset", "clock_drift")
OF_FLOORS = (
    "rolling_resistance", "stiction", "grade", "tyre_grip", "tyre_stiffness", "tyre_relaxation",
    "viscous_drag", "corner_drag", "wind",
)  # fmt: skip
RADII_M = (0.2, 0.35, 0.6)
GRID_M = 0.2  # between the middles of places
MOST_PLACES = 200  # those that the car was at most
JUDGED_AFTER_S = 60.0  # since a change: whoever came to a place once may as well have changed there
MOST_OF_IT = 80.0  # percentile of how far from its middle a place was driven through
FEWEST = 10  # windows of a place that a car drove through
NEAR_M, NEAR_WAY = 0.12, 0.5  # windows so near, and in about the same direction, are alike
AS_WELL, LEFT = 8.0, 0.1
"""A change off known places counts from such a weight on, and from that share of the place's own:
so much of it is left elsewhere, since a car that was braked drives on otherwise for a while."""
AS_MANY = 3.0  # windows of all its driving, that count where none was nearby


@dataclass(frozen=True, slots=True)
class _Rows:
    """All windows of one car that count, n of them, of the numbers of the car that changed.

    Attributes:
        after: Which began since the change, (n,).
        score: Over its spread, of those since the change, less what the car strayed there before,
            (later, numbers).
        information: Likewise, of all, (n, numbers).
    """

    is_changed: bool
    after: Bools
    places: Floats
    cameras: NDArray[np.str_]
    score: Floats
    information: Floats


@dataclass(frozen=True, slots=True)
class _Weighed:
    """What may have caused a change.

    Attributes:
        weight: Of each kind, the logarithm of its probability, but for what all have in common.
        place: Which it would be: x, y, radius [m].
        camera: Likewise.
    """

    weight: dict[Kind, float]
    place: tuple[float, float, float] | None
    camera: str

    @property
    def likeliest(self) -> Kind:
        """Return the kind that weighs most."""
        return max(self.weight, key=lambda kind: self.weight[kind])


def located(
    change: TwinChange, vehicle: str, cars: Mapping[str, Witness],
    places: PlaceWatch | None = None, reaches: Reaches = anywhere,
) -> TwinChange | None:  # fmt: skip
    """Return a change with whose it is, or None where the car that changed shows too little of it.

    Args:
        change: Of the car.
        vehicle: Its name.
        cars: All that drove lately.
        places: Whose change it may be; None: none was watched.
        reaches: Returns whether a car can be sent through a point.
    """
    since_s = [
        seconds(t_ns) for t_ns in (change.since_ns, change.since_low_ns, change.since_high_ns)
    ]
    own = cars.get(vehicle)
    if own is None or not len(own.evidence.t_s) or own.begin_s + own.evidence.t_s[0] >= since_s[1]:
        return None
    driven_s = EVERY_S * float(np.sum(own.begin_s + own.evidence.t_s >= since_s[0]))
    if driven_s < JUDGED_AFTER_S:
        return None
    is_of_place = places is not None and places.has_found(change)
    is_off = None if places is None or is_of_place else places.is_off
    effects = EFFECTS if is_of_place else None
    if is_of_place:  # a car that changed itself as well is no witness of it
        cars = {n: one for n, one in cars.items() if one.evidence.is_steady or n == vehicle}
    causes = causes_of(vehicle, since_s, cars, is_off, effects)
    own_s = [one.probability for one in causes if one.kind in OWN]
    is_sure = max(causes[0].probability, sum(own_s) if causes[0].kind in OWN else 0.0) >= SURE
    cause = causes[0].kind if is_sure else "undecided"
    if change.cause == "place" and cause in OWN:
        return (
            change  # who brakes there, comes to lights at other times, and drives otherwise since
        )
    open_ = {} if is_sure else {one.kind: one for one in causes if one.probability >= POSSIBLE}
    drive = next_drive(change, deciding_drive(change, open_, vehicle, cars, reaches))
    decide_by = "" if is_sure or drive is None else drive_in_words(drive, vehicle)
    pairs = zip(causes, change.causes, strict=False)
    if change.causes and all(
        one.kind == then.kind and abs(one.probability - then.probability) < NEAR
        for one, then in pairs
    ):
        causes = change.causes
    return replace(change, cause=cause, causes=causes, decide_by=decide_by, drive=drive)


def cause_in_words(change: TwinChange, vehicle: str) -> str:
    """Return whose a change is, in a sentence."""
    first = change.causes[0]
    match first.kind:
        case "car":
            return f"{vehicle} itself changed: no other car that drove since did"
        case "tag":
            return f"The tag of {vehicle} is not where it was on the car"
        case "place":
            where = f"within {first.radius_m:.1f} m of {_at(first)}"
            return f"Not {vehicle} changed but the floor, {where}"
        case "camera":
            camera = f"Camera {first.camera}" if first.camera else "The camera"
            return f"{camera} sees cars elsewhere than before: {vehicle} did not change"
        case "everywhere":
            return "All cars drive otherwise than before, wherever they are: look at the floor"


def _at(cause: TwinCause) -> str:
    return f"({cause.x_m:.1f}, {cause.y_m:.1f})"


def causes_of(
    vehicle: str, since_s: Sequence[float], cars: Mapping[str, Witness],
    is_off: IsOff | None = None, effects: Collection[str] | None = None,
) -> tuple[TwinCause, ...]:  # fmt: skip
    """Return what may have caused a change of a car, the likeliest first.

    A car that changed when the floor did shows both. What it shows off the places that are known
    to have changed counts then, if that is anything.

    Args:
        vehicle: That changed.
        since_s: When, on the city's clock: likeliest, and its interval.
        cars: All of the city, this one among them.
        is_off: Returns which windows lie off the places that are known to have changed.
        effects: By whose numbers it is judged; None: by all.
    """
    every = cars[vehicle].evidence.numbers
    numbers = [one for one in every if effects is None or one.effect in effects]
    rows = [_rows(name == vehicle, one, since_s, numbers) for name, one in cars.items()]
    found = _weighed(rows, numbers)
    if found.likeliest == "place" and is_off is not None:
        off = _weighed([_off(one, is_off(one.places)) for one in rows], numbers)
        least = AS_WELL + LEFT * found.weight["place"]
        found = off if off.weight[off.likeliest] > least else found
    top = max(found.weight.values())
    total = sum(math.exp(value - top) for value in found.weight.values())
    x_m, y_m, radius_m = (None, None, None) if found.place is None else found.place
    causes = [
        TwinCause(
            kind=kind,
            probability=math.exp(value - top) / total,
            x_m=x_m if kind == "place" else None,
            y_m=y_m if kind == "place" else None,
            radius_m=radius_m if kind == "place" else None,
            camera=found.camera if kind == "camera" else "",
        )
        for kind, value in found.weight.items()
    ]
    return tuple(sorted(causes, key=lambda one: -one.probability))


def _weighed(rows: Sequence[_Rows], numbers: Sequence[WatchedNumber]) -> _Weighed:
    """Return how likely each cause is by the windows of all cars."""
    own = next(one for one in rows if one.is_changed)
    of_tags, of_cameras, of_sensors, of_floors = _kinds(numbers)
    by_car = _evidence([own], [own.after])
    everywhere = _evidence(rows, [one.after for one in rows])
    by_place, place = _of_places(rows, own, of_floors)
    by_camera, camera = _of_cameras(rows, own, of_cameras)
    of_cars = ~of_tags & ~of_cameras
    at_a_place, _ = _of_places([own], own, of_cars)
    found: dict[Kind, float] = {
        "car": float(np.logaddexp(_mean(by_car[of_cars]), at_a_place + SELDOM)),
        "tag": _mean(by_car[of_tags]),
        "place": by_place,
        "camera": by_camera,
        "everywhere": _mean(everywhere[~of_sensors]),
    }
    weight = {kind: math.log(PRIOR[kind]) + value for kind, value in found.items()}
    return _Weighed(weight, place, camera)


def _off(rows: _Rows, off: Bools) -> _Rows:
    """Return some windows of a car."""
    after = rows.after
    return _Rows(
        rows.is_changed, after[off], rows.places[off], rows.cameras[off], rows.score[off[after]],
        rows.information[off],
    )  # fmt: skip


def _rows(
    is_changed: bool, car: Witness, since_s: Sequence[float], numbers: Sequence[WatchedNumber]
) -> _Rows:  # fmt: skip
    """Return the windows of a car that count, of the numbers of the one that changed."""
    evidence = car.evidence
    t_s = evidence.t_s + car.begin_s
    counts = (t_s >= car.first_s) & (t_s < car.last_s) & ((t_s < since_s[1]) | (t_s >= since_s[0]))
    names = {(one.effect, one.name): k for k, one in enumerate(evidence.numbers)}
    columns = np.array([names.get((one.effect, one.name), -1) for one in numbers])
    spread = np.where(columns >= 0, evidence.inflation[columns], np.inf)
    after, places = t_s[counts] >= since_s[0], evidence.places[counts]
    score = evidence.scores[counts][:, columns] / spread
    information = evidence.information[counts][:, columns] / spread
    usual = _usually(places, after, score[~after], information[~after])
    left = score[after] - usual * information[after]
    return _Rows(is_changed, after, places, evidence.cameras[counts], left, information)


def _usually(places: Floats, after: Bools, score: Floats, information: Floats) -> Floats:
    """Return what each number would be by the windows before the change nearby, (later, numbers).

    A car strays on some bends more than on others: what it strayed there before is no change.

    Args:
        places: Of all windows, (n, 2).
        after: Which began since the change, (n,).
        score: Of each before it, (earlier, numbers).
        information: Likewise.
    """
    if after.all():
        return np.zeros((len(places), score.shape[1]))
    way = np.gradient(places, axis=0) if len(places) > 1 else np.zeros_like(places)
    way = way / np.maximum(np.hypot(*way.T), 1e-6)[:, None]
    where = np.column_stack((places / NEAR_M, way / NEAR_WAY))
    now, then = where[after], where[~after]
    half = 0.5 * (now**2).sum(axis=1)[:, None] + 0.5 * (then**2).sum(axis=1)
    weight = np.exp(now @ then.T - half)  # of half of the squared distance
    level = score.sum(axis=0) / np.maximum(information.sum(axis=0), 1e-30)
    least = AS_MANY * information.mean(axis=0)
    return np.asarray(
        (weight @ score + least * level) / np.maximum(weight @ information + least, 1e-30)
    )


def _kinds(numbers: Sequence[WatchedNumber]) -> tuple[Bools, Bools, Bools, Bools]:
    """Return which numbers are a tag's, a camera's, a sensor's at all, and what a floor does."""
    effects = [one.effect for one in numbers]
    of_sensors = np.array([one.equation == "sensor" for one in numbers])
    of_floors = np.isin(effects, OF_FLOORS)
    return np.isin(effects, OF_TAGS), np.isin(effects, OF_CAMERAS), of_sensors, of_floors


def _evidence(rows: Sequence[_Rows], affected: Sequence[Bools]) -> Floats:
    """Return how much better one change of all affected windows explains them, (numbers,)."""
    every = [share[None] for share in affected]
    (found,) = _joint(rows, every, [~one.after[None] for one in rows])
    return cast("Floats", found)


def _joint(rows: Sequence[_Rows], affected: Sequence[Bools], usual: Sequence[Bools]) -> Floats:
    """Return the evidence of each of some changes, (hypotheses, numbers).

    Of a change of unknown size over that of none, as a logarithm; its size is likely as large as
    the likeliest (empirical Bayes).

    Args:
        rows: Of each car.
        affected: Its windows that each change affects, (hypotheses, n).
        usual: Those before the change by which one knows how it strays there, (hypotheses, n).
    """
    score = np.zeros((len(affected[0]), rows[0].score.shape[1]))
    information = np.zeros_like(score)
    for one, these, those in zip(rows, affected, usual, strict=True):
        now, then = (which.astype(float) @ one.information for which in (these, those))
        share = then / np.maximum(now + then, 1e-30)
        score += share * (these[:, one.after].astype(float) @ one.score)
        information += share * now
    fit = score**2 / np.maximum(information, 1e-30)
    return np.asarray(0.5 * fit**2 / (1.0 + fit) - 0.5 * np.log1p(fit))


def _mean(evidence: Floats) -> float:
    """Return the logarithm of the mean of evidence."""
    if not evidence.size:
        return 0.0
    top = float(evidence.max())
    return top + math.log(float(np.mean(np.exp(evidence - top))))


def _of_cameras(rows: Sequence[_Rows], own: _Rows, numbers: Bools) -> tuple[float, str]:
    """Return the evidence that a camera changed, and which."""
    names = [str(name) for name in np.unique(own.cameras[own.after])]
    found = [
        _mean(_evidence(rows, [one.after & (one.cameras == name) for one in rows])[numbers])
        for name in names
    ]
    return (_mean(np.array(found)), names[int(np.argmax(found))]) if found else (0.0, "")


def _of_places(
    rows: Sequence[_Rows], own: _Rows, numbers: Bools
) -> tuple[float, tuple[float, float, float] | None]:
    """Return the evidence that the floor changed at a place, and where: x, y, radius [m]."""
    places = _places(own.places[own.after])
    if not len(places):
        return 0.0, None
    there = [_inside(one.places, places) for one in rows]
    evidence = _joint(
        rows, [inside & one.after for inside, one in zip(there, rows, strict=True)],
        [inside & ~one.after for inside, one in zip(there, rows, strict=True)],
    )[:, numbers]  # fmt: skip
    best = int(np.argmax(evidence.max(axis=1)))
    pairs = zip(rows, there, strict=True)
    driven = np.concatenate([one.places[inside[best] & one.after] for one, inside in pairs])
    middle = driven.mean(axis=0)  # of a circle that reaches beyond the lanes, the lanes
    radius_m = float(np.percentile(np.hypot(*(driven - middle).T), MOST_OF_IT))
    return _mean(evidence.ravel()), (*middle.tolist(), radius_m)


def _inside(driven: Floats, places: Floats) -> Bools:
    """Return which windows were at each place, (places, windows)."""
    away = np.hypot(*(driven[None] - places[:, None, :2]).transpose(2, 0, 1))
    return cast("Bools", away < places[:, 2:])


def _places(driven: Floats) -> Floats:
    """Return places that a car drove through: x, y and radius, (places, 3) [m]."""
    if len(driven) < FEWEST:
        return np.empty((0, 3))
    cells, counts = np.unique(np.round(driven / GRID_M), axis=0, return_counts=True)
    middles = GRID_M * cells[np.argsort(-counts, kind="stable")[:MOST_PLACES]]
    found = np.concatenate([np.column_stack((middles, np.full(len(middles), r))) for r in RADII_M])
    return cast("Floats", found[_inside(driven, found).sum(axis=1) >= FEWEST])
