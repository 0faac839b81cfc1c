"""By which calibration a camera sees: put in force while it runs, put back, kept over a restart.

A new one is taken only if it can be a camera's, is for frames of the size that come, and puts the
floor's tags where they are seen now: its own doubt has to explain what is left. What was in force
before can always be put back: the self check says what is wrong with it.

The camera as it was started, by the map file and `--calibration`, is the last that can be put back.
What is kept holds only for a camera that was started the same: who changes the map file means it.
"""

import math
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.anchor import KNOCKED_SIGMAS, Anchor
from scm.eye.calibrate.judge import RMS_SHARE
from scm.eye.calibration import Calibration, calibrated, covariance_faults
from scm.eye.camera import CameraModel, camera_model
from scm.eye.watch import WORTH_M, Watch
from scm.records.city_map import Camera, MapTag
from scm.records.eye import Calibrated, InForce
from scm.v2x.messages.calibration_request import CalibrationRequest, MeasuredLens

MOST_KEPT = 10
_OF_THE_SENSOR = ("name", "rate_hz", "noise_sigma", "rolling_s")


class UnsureError(EyeError):
    """A calibration whose poses would be flagged: it is put in force only if that is accepted."""


class Sight(msgspec.Struct, kw_only=True, frozen=True):
    """What a camera sees by.

    Attributes:
        camera: Its lens and place.
        lens_covariance: Of fx, fy, cx, cy and the distortion, nine rows of nine; None: no doubt.
        names: Of the calibrations.
        since_ns: When it was put in force; None: it was started so.
        by: Who did, and `reason` why.
    """

    camera: Camera
    lens_covariance: tuple[tuple[float, ...], ...] | None = None
    names: Calibrated = Calibrated()
    since_ns: int | None = None
    by: str = ""
    reason: str = ""

    def model(self) -> CameraModel:
        """Return the camera.

        Raises:
            EyeError: It cannot be one; naming every key that is wrong.
        """
        doubt = None if self.lens_covariance is None else np.array(self.lens_covariance)
        return camera_model(self.camera, doubt)

    def is_alike(self, other: "Sight") -> bool:
        """Return whether it is the same lens at the same place, whoever put it in force."""
        mine = self.camera, self.lens_covariance
        return mine == (other.camera, other.lens_covariance)


class SightRecord(msgspec.Struct, kw_only=True, frozen=True):
    """What outlives the process: all that can be put back, oldest first, and what is in force."""

    sights: tuple[Sight, ...]


class Sights:
    """What one camera sees by, and what it saw by before.

    Args:
        started: By the map file and `--calibration`.
        kept: Of an earlier run.

    Attributes:
        lapsed: Whether what was kept is of a camera that was started otherwise, so not taken.
    """

    def __init__(self, started: Sight, kept: SightRecord | None = None) -> None:
        same = kept is not None and kept.sights[0].is_alike(started)
        self.lapsed = kept is not None and not same
        self._all = kept.sights if kept is not None and same else (started,)

    @property
    def now(self) -> Sight:
        """What is in force."""
        return self._all[-1]

    @property
    def record(self) -> SightRecord:
        """What is to be kept."""
        return SightRecord(sights=self._all)

    def told(self) -> InForce:
        """Return what is in force, as the status tells it."""
        now, before = self.now, self._all[-2].names if len(self._all) > 1 else None
        return InForce(
            now=now.names, since_ns=now.since_ns, by=now.by, reason=now.reason, before=before
        )

    def serve(self, request: CalibrationRequest, watch: Watch, now_ns: int) -> Watch:
        """Put in force what is asked for; return the watch over the camera from now on.

        Args:
            request: What is asked for.
            watch: Over the camera as it is in force.
            now_ns: The present time.

        Raises:
            UnsureError: Its poses would be flagged `unsure`, and the request does not accept that.
            EyeError: It cannot be in force, in words; what is in force stays.
        """
        if request.verb == "back":
            return self._back(request, watch, now_ns)
        new = self._asked(request, now_ns)
        model, seen = new.model(), watch.tags_seen(now_ns)
        _refuse_misfit(model, watch.anchor.map_tags, seen)
        watch = _watch(model, watch, seen)
        if not request.accept_unsure:
            _refuse_unsure(watch.anchor)
        first, *later = *self._all, new
        self._all = (first, *later[1 - MOST_KEPT :])
        return watch

    def _back(self, request: CalibrationRequest, watch: Watch, now_ns: int) -> Watch:
        if len(self._all) == 1:
            raise EyeError(
                f"camera {self.now.camera.name!r}: nothing to put back: it sees as it was started"
            )
        *others, before, _ = self._all
        facts = {"since_ns": now_ns, "by": request.by, "reason": request.reason}
        self._all = (*others, msgspec.structs.replace(before, **facts))
        return _watch(self.now.model(), watch, watch.tags_seen(now_ns))

    def _asked(self, request: CalibrationRequest, now_ns: int) -> Sight:
        now, name = self.now, request.calibration
        if request.place is not None:
            camera, names = _placed(now.camera, request.place), Calibrated(place=name)
            doubt = _doubt(camera, request.lens)
        elif request.lens is not None:
            lens = _checked(request.lens)
            camera = calibrated(now.camera, lens)
            names, doubt = msgspec.structs.replace(now.names, lens=name), lens.covariance
        else:
            raise EyeError("calibration: expected a lens or a place to use, got neither")
        return Sight(
            camera=camera, lens_covariance=doubt, names=names,
            since_ns=now_ns, by=request.by, reason=request.reason,
        )  # fmt: skip


def started(camera: Camera, lens: Calibration | None) -> Sight:
    """Return what a camera sees by when nobody has put anything else in force."""
    if lens is None:
        return Sight(camera=camera)
    return Sight(camera=calibrated(camera, lens), lens_covariance=lens.covariance)


def _placed(camera: Camera, place: Camera) -> Camera:
    """Return a camera of a found place, its sensor as it is."""
    if place.name != camera.name:
        raise EyeError(f"place: expected one of camera {camera.name!r}, got one of {place.name!r}")
    has, got = (f"{one.width_px} x {one.height_px}" for one in (camera, place))
    if has != got:
        raise EyeError(
            f"camera {camera.name!r}: expected a place found in frames of {has} px, got {got} px"
        )
    same = {name: getattr(camera, name) for name in _OF_THE_SENSOR}
    return msgspec.structs.replace(place, **same)


def _doubt(camera: Camera, lens: MeasuredLens | None) -> tuple[tuple[float, ...], ...] | None:
    """Return the covariance of the lens that a place was found with; None: it has none."""
    if lens is None:
        return None
    measured = _checked(lens)
    if calibrated(camera, measured) != camera:
        raise EyeError("lens: expected the one that the place was found with, got another")
    return measured.covariance


def _checked(lens: MeasuredLens) -> Calibration:
    faults = covariance_faults(lens.covariance)
    if faults:
        raise EyeError(f"lens: covariance: {faults}")
    most_px = RMS_SHARE * lens.width_px
    if not 0.0 <= lens.rms_px <= most_px:
        raise EyeError(
            f"lens: rms_px: expected at most {most_px:.2f} px left at the board's points, got "
            f"{lens.rms_px:.2f} px"
        )
    return msgspec.convert(msgspec.to_builtins(lens), Calibration)


def _watch(model: CameraModel, before: Watch, seen: Mapping[int, Floats]) -> Watch:
    """Return a watch over the camera as it is in force now, that knows where the tags are seen."""
    watch = Watch(Anchor(model, before.anchor.map_tags))
    if before.anchor.seen_ns is not None:
        watch.anchor.see(seen, before.anchor.seen_ns)
    return watch


def _refuse_misfit(
    model: CameraModel, map_tags: Sequence[MapTag], seen: Mapping[int, Floats]
) -> None:
    """Refuse a camera that does not put the floor's tags where they are seen now."""
    name, tags = model.camera.name, [tag for tag in map_tags if tag.tag_id in seen]
    if not tags:
        wanted = ", ".join(str(tag.tag_id) for tag in map_tags)
        raise EyeError(
            f"camera {name!r}: expected a map tag ({wanted}) in view to check the calibration by, "
            "sees none now"
        )
    trial = Watch(Anchor(model, tuple(map_tags)))
    off = [seen[tag.tag_id] - trial.anchor.expected(tag) for tag in tags]
    off_px, sigmas = math.sqrt(2.0 * np.mean(np.square(off))), trial.anchor.surprise(seen)
    elsewhere = trial.misplaced(seen)
    if sigmas > KNOCKED_SIGMAS or elsewhere:
        raise EyeError(
            f"camera {name!r}: map tags are {off_px:.1f} px from where this calibration puts them, "
            f"{sigmas:.0f} times what its doubt explains (at most {KNOCKED_SIGMAS:.0f})"
            + "".join(f"; {words}" for words in elsewhere.values())
        )


def _refuse_unsure(anchor: Anchor) -> None:
    """Refuse a camera whose poses the self check would flag, as known as its tags make it now."""
    worth = anchor.doubt_m()
    if worth > WORTH_M:
        raise UnsureError(
            f"camera {anchor.model.camera.name!r}: poses by this calibration would be good to "
            f"{2e3 * worth:.0f} mm only (at most {2e3 * WORTH_M:.0f} mm pass): the Eye would flag "
            "them as unsure and guarded cars would stop; locate it with more tags, far apart, or "
            "put it in force all the same with accept_unsure"
        )


def said(camera: str, in_force: InForce) -> str:
    """Return in one sentence by what a camera sees, who wanted it and why."""
    names = {"lens": in_force.now.lens, "place": in_force.now.place}
    what = " and ".join(f"{kind} {name}" for kind, name in names.items() if name)
    why = f": {in_force.reason}" if in_force.reason else ""
    return f"camera {camera} sees by {what or 'the map file again'}, by {in_force.by}{why}"
