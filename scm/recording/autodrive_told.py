"""What is to be known of AutoDRIVE's logs before one believes them: clocks, signs, wheels."""

import math

import numpy as np

from scm.arrays import Bools, Floats, Ints
from scm.recording.autodrive import POSITION
from scm.recording.autodrive_read import Log

LONGEST_STEP_MS = 250  # longer is a gap, as for a replay
SET_BACK_MS = 1000  # so far back a clock was set; less is a row out of order
AFTER_SET_BACK_MS = 1000
TURNING_RAD, MOVING_MPS, FEWEST_ROWS, DISAGREE = 0.02, 0.02, 20, 0.7
FLAT_M, LONGEST_STEERING_RAD, SAME_SCAN_M = 1e-3, 1.6, 1e-3
SLIPS = 0.02


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
    told = [f"{log.path.name}: {len(log.lines)} rows{rate}"]
    if (repeated := int(np.sum(step == 0))) > 0:
        told.append(f"  {repeated} stamps repeat the one before: a replay takes the first of each")
    if (back := int(np.sum((step < 0) & (step > -SET_BACK_MS)))) > 0:
        told.append(f"  {back} stamps go back by less than a second: a replay leaves them out")
    told += [
        f"  line {log.lines[k + 1]}: the clock was set back by {-step[k] / 1000:.3f} s: rows "
        f"from there on are counted on from {AFTER_SET_BACK_MS / 1000:g} s later"
        for k in np.flatnonzero(step <= -SET_BACK_MS)
    ]
    gaps = np.flatnonzero(step > LONGEST_STEP_MS)
    if len(gaps):
        worst = gaps[np.argmax(step[gaps])]
        told.append(
            f"  {len(gaps)} gaps of more than {LONGEST_STEP_MS / 1000:g} s, the longest of "
            f"{step[worst] / 1000:.3f} s before line {log.lines[worst + 1]}"
        )
    return told


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
    told = []
    largest = float(np.nanmax(np.abs(steering), initial=0.0))
    if largest > LONGEST_STEERING_RAD:
        told.append(f"  steering reaches {largest:g}, expected radian: is it in degree?")
    turning: Bools = (np.abs(steering) > TURNING_RAD) & (np.abs(speed) > MOVING_MPS)
    turning &= np.isfinite(yaw_rate)
    agrees = np.sign(steering[turning] * speed[turning]) == np.sign(yaw_rate[turning])
    if len(agrees) >= FEWEST_ROWS and (wrong := float(np.mean(~agrees))) > DISAGREE:
        told.append(
            f"  in {wrong:.0%} of {len(agrees)} turning rows the car turns against its steering: "
            "the other --steering-positive is meant"
        )
    return told


def of_wheels(log: Log, x: Floats, y: Floats, m_per_count: float | None) -> list[str]:
    """Tell by how much the wheels turned more than the car went: that is kept as it is."""
    counts = (log.numbers("leftTicks") + log.numbers("rightTicks")) / 2.0
    gone = _length(np.stack((x, y)))
    rolled = _length(counts[None]) * (m_per_count or math.nan)
    if not (gone > 0.1 and rolled > 0.0 and abs(rolled / gone - 1.0) > SLIPS):
        return []
    return [
        f"  wheels rolled {rolled:.2f} m, poses went {gone:.2f} m: encoders read "
        f"{rolled / gone - 1.0:+.1%} (AutoDRIVE's wheels slip, by 11 % straight ahead at full "
        "throttle): kept as they are"
    ]


def of_scans(log: Log) -> list[str]:
    """Tell how far the LIDAR's scans can be believed: they were taken when the log was written."""
    if log.scans is None:
        return []
    there = ~np.isnan(log.scans).all(axis=1)
    same = (log.scans[1:] == log.scans[:-1]) | (np.isnan(log.scans[1:]) & np.isnan(log.scans[:-1]))
    new = 1 + int(np.sum(~same.all(axis=1)))
    told = (
        f"  LIDAR: {int(there.sum())} rows of {log.scans.shape[1]} beams, {new} scans differ from "
        "the row before; scans were taken when the log was written, so any may be stale"
    )
    scans = log.scans[there]
    first = next((k for k, scan in enumerate(scans) if not _is_alike(scan, scans[-1])), 0)
    return [told + (f": the first {first} rows hold the last one's" if first else "")]


def _is_alike(scan: Floats, other: Floats) -> bool:
    """Say whether two scans were taken at one place."""
    both = np.isfinite(scan) & np.isfinite(other)
    return bool(both.any() and np.median(np.abs(scan[both] - other[both])) < SAME_SCAN_M)


def _length(points: Floats) -> float:
    """Return the length of a path, shape (dimensions, rows); rows with a NaN are left out."""
    kept = points[:, np.isfinite(points).all(axis=0)]
    return float(np.sum(np.hypot.reduce(np.diff(kept, axis=1), axis=0)))
