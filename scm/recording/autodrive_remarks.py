"""Checks AutoDRIVE's logs and reports problems with clocks, signs and wheels."""

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.recording.autodrive import POSITION
from scm.recording.autodrive_read import TICKS, Log

LONGEST_STEP_MS = 250  # longer is a gap, as for a replay
SET_BACK_MS = 1000  # so far back a clock was set; less is a row out of order
AFTER_SET_BACK_MS = 1000
TURNING_RAD, MOVING_MPS, FEWEST_ROWS, DISAGREE = 0.02, 0.02, 20, 0.7
FLAT_M, LONGEST_STEERING_RAD, SAME_SCAN_M = 1e-3, 1.6, 1e-3
SLIPS, MOST_SLIP = 0.02, 0.2  # at more, a tyre pushes less and less: Nigel's is at its limit there
OTHER_CAR = 0.6, 1.6  # of the way that the file's wheels would count: no wear, no filling does more
SHORTEST_WAY_M = 0.1
LEAP, USUAL = 4.0, 95  # a step so many times the 95th percentile of all is none that was driven


def counted_on(stamps_ms: Ints) -> Ints:
    """Return times that a clock that was set back does not repeat [ms], shape (rows,).

    Rows after it was set back by `SET_BACK_MS` or more are counted on from a second later.
    """
    step = np.diff(stamps_ms)
    lost = np.where(step <= -SET_BACK_MS, AFTER_SET_BACK_MS - step, 0)
    times: Ints = stamps_ms + np.concatenate(([0], np.cumsum(lost)))
    return times


def of_clock(log: Log) -> list[str]:
    """Tell the rate of a log, and where its stamps repeat, go back or jump."""
    step = np.diff(log.stamps_ms)
    forward = step[step > 0]
    rate = f", {1000.0 / float(np.median(forward)):.1f} rows a second" if len(forward) else ""
    remarks = [f"{log.path.name}: {len(log.lines)} rows{rate}"]
    if (repeated := int(np.sum(step == 0))) > 0:
        remarks.append(
            f"  {repeated} stamps repeat the one before: a replay takes the first of each"
        )
    if (back := int(np.sum((step < 0) & (step > -SET_BACK_MS)))) > 0:
        remarks.append(f"  {back} stamps go back by less than a second: a replay leaves them out")
    remarks += [
        f"  line {log.lines[k + 1]}: the clock was set back by {-step[k] / 1000:.3f} s: rows "
        f"from there on are counted on from {AFTER_SET_BACK_MS / 1000:g} s later"
        for k in np.flatnonzero(step <= -SET_BACK_MS)
    ]
    gaps = np.flatnonzero(step > LONGEST_STEP_MS)
    if len(gaps):
        worst = gaps[np.argmax(step[gaps])]
        remarks.append(
            f"  {len(gaps)} gaps of more than {LONGEST_STEP_MS / 1000:g} s, the longest of "
            f"{step[worst] / 1000:.3f} s before line {log.lines[worst + 1]}"
        )
    return remarks


def of_axes(log: Log) -> list[str]:
    """Tell of positions that look like Unity's own, in which y is up."""
    there = [log.numbers(name) for name in POSITION]
    if any(not np.isfinite(values).any() for values in there):
        return []
    spread = [float(np.nanmax(values) - np.nanmin(values)) for values in there]
    if spread[1] < FLAT_M and spread[2] > 100 * FLAT_M:
        return [
            f"  posY stays within {1000 * spread[1]:.1f} mm and posZ goes over {spread[2]:.2f} m: "
            "these look like Unity's axes: give --axes unity"
        ]
    return []


def of_steering(steering: Floats, speed: Floats, yaw_rate: Floats) -> list[str]:
    """Tell of steering whose sign or unit is not what was said.

    Args:
        steering: As it will be read, + = left [rad], shape (rows,).
        speed: + = forward [m/s], shape (rows,).
        yaw_rate: + = left [rad/s], shape (rows,).
    """
    remarks = []
    largest = float(np.nanmax(np.abs(steering), initial=0.0))
    if largest > LONGEST_STEERING_RAD:
        remarks.append(f"  steering reaches {largest:g}, expected radian: is it in degree?")
    turning: Bools = (np.abs(steering) > TURNING_RAD) & (np.abs(speed) > MOVING_MPS)
    turning &= np.isfinite(yaw_rate)
    agrees = np.sign(steering[turning] * speed[turning]) == np.sign(yaw_rate[turning])
    if len(agrees) >= FEWEST_ROWS and (wrong := float(np.mean(~agrees))) > DISAGREE:
        remarks.append(
            f"  in {wrong:.0%} of {len(agrees)} turning rows the car turns against its steering: "
            "the other --steering-positive is meant"
        )
    return remarks


def of_wheels(log: Log, m_per_count: float | None, car: str, instead: str) -> list[str]:
    """Tell of encoders that do not count the way that the poses go; cells are kept as they are.

    Args:
        log: Of a car.
        m_per_count: What the file's car rolls for one count [m]; None: not known.
        car: Name of that file.
        instead: What to do where it is another car's.
    """
    place = np.stack((log.numbers("posX"), log.numbers("posY")))
    remarks, counters = [], []
    for name in TICKS:
        counts = log.numbers(name)
        known = counts[np.isfinite(counts)]
        odd = known[known != np.rint(known)]
        way_m, _ = _ways(place, np.stack((counts, counts)))
        if len(odd):
            some = ", ".join(f"{value:g}" for value in odd[:3])
            remarks.append(
                f"  {name}: {len(odd)} of {len(known)} cells are not whole ({some}, ...): not the "
                "counts of an encoder, and not read as such"
            )
        elif len(known) and np.ptp(known) == 0.0 and way_m > SHORTEST_WAY_M:
            remarks.append(f"  {name} stays at {known[0]:g} while poses go {way_m:.2f} m")
        elif len(known):
            counters.append(counts)
    if m_per_count is None or not counters:
        return remarks
    gone_m, rolled_m = _ways(place, m_per_count * np.mean(counters, axis=0)[None])
    ratio = rolled_m / gone_m if gone_m > SHORTEST_WAY_M else 1.0
    ways = f"  wheels rolled {rolled_m:.2f} m, poses went {gone_m:.2f} m"
    more = f"{ways}: encoders read {ratio - 1:+.1%}"
    if not OTHER_CAR[0] < ratio < OTHER_CAR[1]:
        remarks.append(
            f"{more}: {log.path.name} is not of the car {car}, by its encoders: {instead}"
        )
    elif SLIPS < ratio - 1.0 < MOST_SLIP:
        remarks.append(f"{more}, as driven wheels that slip do: kept as they are")
    elif abs(ratio - 1.0) > SLIPS:
        remarks.append(
            f"{more}, expected 0 to {MOST_SLIP:+.0%}: check wheel.radius_m and "
            f"encoder.counts_per_revolution of the car {car}; kept as they are"
        )
    return remarks


def of_scans(log: Log) -> list[str]:
    """Tell how far the LIDAR's scans can be believed: they were taken when the log was written."""
    if log.scans is None:
        return []
    there = ~np.isnan(log.scans).all(axis=1)
    same = (log.scans[1:] == log.scans[:-1]) | (np.isnan(log.scans[1:]) & np.isnan(log.scans[:-1]))
    new = 1 + int(np.sum(~same.all(axis=1)))
    remarks = (
        f"  LIDAR: {int(there.sum())} rows of {log.scans.shape[1]} beams, {new} scans differ from "
        "the row before; scans were taken when the log was written, so any may be stale"
    )
    scans = log.scans[there]
    first = next((k for k, scan in enumerate(scans) if not _is_alike(scan, scans[-1])), 0)
    return [remarks + (f": the first {first} rows hold the last one's" if first else "")]


def _is_alike(scan: Floats, other: Floats) -> bool:
    """Say whether two scans were taken at one place."""
    both = np.isfinite(scan) & np.isfinite(other)
    return bool(both.any() and np.median(np.abs(scan[both] - other[both])) < SAME_SCAN_M)


def _ways(first: Floats, second: Floats) -> tuple[float, float]:
    """Return how long two paths are over the same steps, each of shape (dimensions, rows).

    Steps in which either leaps count in neither: the car was put elsewhere, a counter began anew.
    """
    known = np.isfinite(first).all(axis=0) & np.isfinite(second).all(axis=0)
    steps = [np.hypot.reduce(np.diff(one[:, known], axis=1), axis=0) for one in (first, second)]
    usual = np.ones(max(0, int(known.sum()) - 1), np.bool_)
    for step in steps:
        if (step > 0.0).any():
            usual &= step <= LEAP * np.percentile(step[step > 0.0], USUAL)
    first_m, second_m = (float(step[usual].sum()) for step in steps)
    return first_m, second_m
