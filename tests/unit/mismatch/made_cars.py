"""Drives of several cars under one camera, and their searches where nothing was found yet."""

from dataclasses import replace

import numpy as np

from scm.mismatch.diagnose import Searched
from scm.mismatch.effect_catalogue import by_name, candidates
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.fitter import Fitted
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.select.search import Search, Step
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive, nigel

LISTED = ("camera_tilt", "pose_point", "pose_heading", "pose_latency", "steer_trim", "grade")


def tilted(recording, tilt_x, tilt_y):
    """The same drive seen by a camera that looks askew."""
    x, y = (recording.channels[f"pose.{axis}"] for axis in "xy")
    size = 1.0 / (1.0 + tilt_x * x.values + tilt_y * y.values)
    seen = {
        "pose.x": replace(x, values=size * x.values),
        "pose.y": replace(y, values=size * y.values),
    }
    return replace(recording, channels=recording.channels | seen)


def tagged(recording, ahead_m, left_m):
    """The same drive by a tag that is not where it is said to be."""
    x, y, yaw = (recording.channels[f"pose.{name}"] for name in ("x", "y", "yaw"))
    c, s = np.cos(yaw.values), np.sin(yaw.values)
    seen = {
        "pose.x": replace(x, values=x.values + c * ahead_m - s * left_m),
        "pose.y": replace(y, values=y.values + s * ahead_m + c * left_m),
    }
    return replace(recording, channels=recording.channels | seen)


def drive_of(seed, seconds=13.0):
    """One healthy car's drive."""
    return made_drive(seconds=seconds, seed=seed)


def searched(recording, **found):
    """A search that found the effects given, by name with values to begin from."""
    drives = [Drive(recording, big_nigel())]
    model = Likelihood(drives, big_nigel())
    parts = split(model)
    listed = candidates(big_nigel())
    library = tuple(by_name(listed, name) for name in LISTED)
    search = Search(model, parts.fit.weight + parts.choose.weight, library, lambda _: None)
    effects = tuple(by_name(library, name) for name in found)
    values = np.array([v for some in found.values() for v in some], dtype=float)
    begun = search.fitter.null()
    if effects:
        begun = Fitted(effects, begun.z, values, np.zeros(0), 0.0, np.zeros((0, 0)))
    (best,) = search.fitter.refine([begun], rounds=3, fresh=True)
    if not effects:
        search.retuned = best
        search.steps = [_tried(search, best)]
    return Searched(
        (recording,), drives, nigel(), model, parts, search, best, False, (), None, None
    )  # fmt: skip


def _tried(search, base):
    """The first round of a search, of which only a tilt was refitted."""
    tilt = by_name(search.listed, "camera_tilt")
    trials = [((tilt,), np.array(start)) for start in tilt.starts]
    begun = search.fitter.begin(base, trials, amplified=True)
    rivals = search.fitter.refine(sorted(begun, key=lambda f: f.q)[:1], rounds=3)
    return Step(base, tuple(rivals), tuple(search.criterion(f) for f in rivals))
