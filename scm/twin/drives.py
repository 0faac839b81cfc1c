"""The drive that would decide whose a change is: which car, and where.

What a car can still show of a place is what it drives there since the change, as far as it knows
how it strayed there before. A drive adds some windows to the former: the car to which they add most
is the one to send.
"""

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from msgspec.structs import replace

from scm.arrays import Bools, Floats
from scm.clock import nanoseconds, seconds
from scm.records.twins import Kind, TwinCause, TwinChange, TwinDrive
from scm.twin.evidence import OWN, Witness

Point = tuple[float, float]
Reaches = Callable[[str, Point], bool]
PENDING = ("waiting", "under_way")  # states of a drive that somebody agreed to
NEW_WINDOWS = 20.0  # that a drive adds at a place: some passes of it
NEAR_M, CELL_M = 0.35, 0.2  # of a point that was driven through; between such points
AWAY_M = 1.0  # from the middle of a place that changed, beyond its radius
DROVE_THERE = 10  # windows
RESTARTED = "the twin part was started again: what cars drove before is forgotten"
AFTER_NS = nanoseconds(60.0)  # of a drive, until all that it shows was looked at


def anywhere(vehicle: str, point: Point) -> bool:
    """Return that a car can be sent everywhere."""
    del vehicle, point
    return True


def deciding_drive(
    change: TwinChange, open_: Mapping[Kind, TwinCause], vehicle: str,
    cars: Mapping[str, Witness], reaches: Reaches,
) -> TwinDrive | None:  # fmt: skip
    """Return the drive that would decide between causes, or None where one remains.

    Args:
        change: Of the car.
        open_: Causes that may be.
        vehicle: That changed.
        cars: All that drove lately, this one among them.
        reaches: Returns whether a car can be sent through a point.
    """
    if not open_:
        return None
    is_own = any(kind in open_ for kind in OWN)
    drive = TwinDrive(vehicle=vehicle, t_ns=change.noticed_ns)
    place, camera = open_.get("place"), open_.get("camera")
    if place is not None and place.x_m is not None and place.y_m is not None:
        middle = place.x_m, place.y_m
        if not is_own:
            away_m = (place.radius_m or 0.0) + AWAY_M
            return _elsewhere(drive, change, cars[vehicle], middle, away_m, reaches)
        name = _most_to_show(change, vehicle, cars, middle, reaches)
        return replace(drive, vehicle=name, x_m=middle[0], y_m=middle[1])
    if is_own and camera is not None and camera.camera:
        return _under(camera.camera, drive, change, cars, reaches)
    if is_own and any(kind not in OWN for kind in open_):
        return replace(drive, vehicle=_most_to_show(change, vehicle, cars, None, reaches))
    return drive


def next_drive(change: TwinChange, found: TwinDrive | None) -> TwinDrive | None:
    """Return a change's drive from now on: one that somebody agreed to stays as it is.

    Args:
        change: As it was known until now.
        found: What would decide it now; None: nothing has to be.
    """
    before = change.drive
    if before is None:
        return found
    if found is None:
        return before if before.state in ("under_way", "driven") else None
    if before.state in PENDING:
        return before
    as_before = before.state == "open" and before.vehicle == found.vehicle
    if as_before and before.camera == found.camera and _is_near(before, found):
        return before
    return replace(found, sent=before.sent)


def is_recent(drive: TwinDrive | None, now_ns: int) -> bool:
    """Return whether a car was sent, and what it drives or drove may still decide.

    Args:
        drive: Of a change.
        now_ns: On the clock of the car that changed.
    """
    if drive is None or not drive.sent:
        return False
    return drive.state == "under_way" or now_ns - drive.t_ns <= AFTER_NS


def drive_in_words(drive: TwinDrive, of: str) -> str:
    """Return which car would have to drive where, to decide whose a car's change is."""
    who = drive.vehicle or "another car"
    if drive.camera and drive.x_m is None:
        return f"Let {who} drive where camera {drive.camera} sees it."
    if drive.x_m is None:
        return f"Let {of} drive on." if who == of else f"Let {who} drive for a minute."
    if who == of:
        return f"Let {of} drive elsewhere, such as through {at(drive)}."
    if drive.camera:
        return f"Let {who} drive through {at(drive)}, where camera {drive.camera} sees it."
    return f"Let {who} drive through {at(drive)}, and {of} elsewhere."


def at(place: TwinDrive) -> str:
    """Return where a drive leads, in words."""
    return f"({place.x_m:.1f}, {place.y_m:.1f})"


def _is_near(first: TwinDrive, second: TwinDrive) -> bool:
    """Return whether two drives lead to the same place."""
    if first.x_m is None or first.y_m is None or second.x_m is None or second.y_m is None:
        return first.x_m == second.x_m
    return math.dist((first.x_m, first.y_m), (second.x_m, second.y_m)) < CELL_M


def _elsewhere(
    drive: TwinDrive, change: TwinChange, own: Witness, middle: Point, away_m: float,
    reaches: Reaches,
) -> TwinDrive:  # fmt: skip
    """Return a drive of the car that changed, where it was most before, away from a place."""
    is_before = _times_s(own) < seconds(change.since_ns)
    for x_m, y_m in _points(own, is_before & (_away_m(own, middle) > away_m)):
        if reaches(drive.vehicle, (x_m, y_m)):
            return replace(drive, x_m=x_m, y_m=y_m)
    return drive


def _under(
    camera: str, drive: TwinDrive, change: TwinChange, cars: Mapping[str, Witness],
    reaches: Reaches,
) -> TwinDrive:  # fmt: skip
    """Return a drive of another car to where a camera saw the one that changed most since."""
    own = cars[drive.vehicle]
    is_seen = (own.evidence.cameras == camera) & (_times_s(own) >= seconds(change.since_ns))
    for point in _points(own, is_seen):
        name = _most_to_show(change, drive.vehicle, cars, point, reaches)
        if name:
            return replace(drive, vehicle=name, camera=camera, x_m=point[0], y_m=point[1])
    return replace(drive, vehicle="", camera=camera)


def _points(car: Witness, driven: Bools) -> Iterator[Point]:
    """Yield points of some windows of a car, those where it was most first."""
    cells = np.round(car.evidence.places[driven] / CELL_M)
    if not len(cells):
        return
    middles, counts = np.unique(cells, axis=0, return_counts=True)
    for k in np.argsort(-counts, kind="stable").tolist():
        yield CELL_M * float(middles[k, 0]), CELL_M * float(middles[k, 1])


def _most_to_show(
    change: TwinChange, vehicle: str, cars: Mapping[str, Witness], point: Point | None,
    reaches: Reaches,
) -> str:  # fmt: skip
    """Return the car to which a drive through a point would add most; empty: none.

    Those that did not drive there since the change come first.
    """
    found = list[tuple[bool, float, str]]()
    for name, car in cars.items():
        if name == vehicle:
            continue
        there, since = _there(car, point), _times_s(car) >= seconds(change.since_ns)
        gain = _gain(_information(car, change), there, since) if math.isinf(car.last_s) else 0.0
        if gain > 0.0:
            found.append((int(np.sum(there & since)) >= DROVE_THERE, -gain, name))
    names = (name for _, _, name in sorted(found))
    return next((name for name in names if point is None or reaches(name, point)), "")


def _gain(information: Floats, there: Bools, since: Bools) -> float:
    """Return how much more of a change new windows at a place would show.

    Of windows before and since, what they show of a change is `before * since / (before + since)`,
    each the sum of their information.
    """
    before = float(np.sum(information[there & ~since]))
    if before <= 0.0:
        return 0.0
    now = float(np.sum(information[there & since]))
    new = NEW_WINDOWS * float(np.mean(information[there & ~since]))
    return before * (now + new) / (before + now + new) - before * now / (before + now)


def _information(car: Witness, change: TwinChange) -> Floats:
    """Return what each window of a car shows of the number that changed; zeros: it has none."""
    evidence = car.evidence
    names = [(one.effect, one.name) for one in evidence.numbers]
    if (change.effect, change.parameter) not in names or not len(evidence.t_s):
        return np.zeros(len(evidence.t_s))
    k = names.index((change.effect, change.parameter))
    counts = (_times_s(car) >= car.first_s) & (_times_s(car) < car.last_s)
    return np.asarray(counts * evidence.information[:, k] / evidence.inflation[k])


def _times_s(car: Witness) -> Floats:
    """Return when each window of a car begins, on the city's clock."""
    return np.asarray(car.begin_s + car.evidence.t_s)


def _there(car: Witness, point: Point | None) -> Bools:
    """Return which windows of a car were near a point; all without one."""
    if point is None:
        return np.ones(len(car.evidence.t_s), np.bool_)
    return np.asarray(_away_m(car, point) < NEAR_M)


def _away_m(car: Witness, point: Point) -> Floats:
    """Return how far from a point each window was."""
    return np.asarray(np.hypot(*(car.evidence.places - np.array(point)).T))


def interrupted(change: TwinChange) -> TwinChange:
    """Return a change of an earlier process, whose memory is gone."""
    drive = change.drive
    if drive is not None and drive.state in ("open", *PENDING):
        drive = replace(drive, state="failed", reason=RESTARTED)
        change = replace(change, drive=drive)
    if change.search not in ("driving", "searching"):
        return change
    text = "The twin part was started again before its cause was found."
    return replace(change, search="failed", text=text)
