"""Drives of several cars under one camera, and selections of their effects."""

from dataclasses import replace

import numpy as np

from scm.mismatch.effect_catalogue import candidates
from scm.mismatch.fit.data_split import split
from scm.mismatch.fit.likelihood import Likelihood
from scm.mismatch.select.round import Context, Round
from scm.mismatch.select.search import Selection
from scm.mismatch.select.selected import Selected
from scm.replay.drive import Drive
from tests.unit.mismatch.made_drive import big_nigel, made_drive, nigel
from tests.unit.mismatch.made_fit import by_name

CATALOGUE = ("camera_tilt", "pose_point", "pose_heading", "pose_latency", "steer_trim", "grade")


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
    """The same drive by a tag that is not where its car file has it."""
    x, y, yaw = (recording.channels[f"pose.{name}"] for name in ("x", "y", "yaw"))
    c, s = np.cos(yaw.values), np.sin(yaw.values)
    seen = {
        "pose.x": replace(x, values=x.values + c * ahead_m - s * left_m),
        "pose.y": replace(y, values=y.values + s * ahead_m + c * left_m),
    }
    return replace(recording, channels=recording.channels | seen)


def drive_of(seed, seconds=9.0):
    """One healthy car's drive."""
    return made_drive(seconds=seconds, seed=seed)


def selected(recording, **found):
    """A selection that found the effects given, by name with values to begin from."""
    drives = [Drive(recording, big_nigel())]
    model = Likelihood.of(drives, big_nigel())
    parts = split(model)
    catalogue = tuple(by_name(candidates(big_nigel()), name) for name in CATALOGUE)
    context = Context(parts.fit.weight + parts.choose.weight, catalogue)
    effects = tuple(by_name(catalogue, name) for name in found)
    values = np.array([v for some in found.values() for v in some], dtype=float)
    fitter = context.fitter(model)
    begun = replace(fitter.unfitted(), effects=effects, values=values)
    (best,) = fitter.refine([begun], rounds=3, fresh=True)
    rounds = () if effects else (_tried(context, best),)
    return Selected(
        (recording,), drives, nigel(), context, parts, Selection(best, best, rounds), (), None, None
    )


def _tried(context, base):
    """The first round of a selection, of which only a tilt was refitted."""
    tilt, fitter = by_name(context.catalogue, "camera_tilt"), context.fitter(base.model)
    begun = fitter.begin(base, [((tilt,), np.array(s)) for s in tilt.starts], amplified=True)
    tried = fitter.refine(sorted(begun, key=lambda f: f.score)[:1], rounds=3)
    return Round(base, tuple(tried), tuple(context.criterion(f) for f in tried))
