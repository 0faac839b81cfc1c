"""The calibration in force of a camera: changed while it runs, reverted, persisted over a restart.

A new calibration is accepted only if it is valid, is for frames of the present size, and explains,
within its own covariance, where the floor's tags are seen now. The previous calibration can always
be restored: the camera monitor reports what is wrong with it.

The camera as it was started, by the map file and `--calibration`, is the last that can be restored.
Persisted calibrations apply only to a camera that is started the same way: a changed map file wins.
"""

import math
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError
from scm.eye.calibrate.assessment import RMS_SHARE
from scm.eye.calibration import Calibration, calibrated, covariance_faults
from scm.eye.camera import CameraModel, camera_model
from scm.eye.camera_monitor import MAX_STD_M, CameraMonitor
from scm.eye.extrinsics import KNOCKED_SIGMAS, ExtrinsicsEstimator
from scm.records.city_map import Camera, MapTag
from scm.records.eye import Calibrated, InForce
from scm.v2x.messages.calibration_request import CalibrationRequest, MeasuredLens

MAX_STATES = 10  # the first and the newest
_OF_THE_SENSOR = ("name", "rate_hz", "noise_sigma", "rolling_s")


class UnsureError(EyeError):
    """A calibration whose poses would be flagged as uncertain; it needs explicit acceptance."""


class CalibrationState(msgspec.Struct, kw_only=True, frozen=True):
    """A calibration of a camera, and who put it in force.

    Attributes:
        camera: Lens and place.
        lens_covariance: Of fx, fy, cx, cy and the distortion, nine rows of nine; None: exact.
        names: Of the calibrations.
        since_ns: When it was put in force; None: at the start.
        by: Who put it in force, and `reason` why.
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
            EyeError: It is invalid; naming every wrong key.
        """
        lens_covariance = None if self.lens_covariance is None else np.array(self.lens_covariance)
        return camera_model(self.camera, lens_covariance)

    def is_alike(self, other: "CalibrationState") -> bool:
        """Return whether lens and place are the same, by whomever they were put in force."""
        mine = self.camera, self.lens_covariance
        return mine == (other.camera, other.lens_covariance)


class CalibrationHistory(msgspec.Struct, kw_only=True, frozen=True):
    """Persisted: all calibrations that can be restored, oldest first; the last is in force."""

    states: tuple[CalibrationState, ...] = msgspec.field(name="sights")


class ActiveCalibration:
    """The calibration of one camera, and its history.

    Args:
        started: From the map file and `--calibration`.
        restored: History of an earlier run.

    Attributes:
        lapsed: Whether the history was discarded, since the camera was started differently.
    """

    def __init__(
        self, started: CalibrationState, restored: CalibrationHistory | None = None
    ) -> None:
        same = restored is not None and restored.states[0].is_alike(started)
        self.lapsed = restored is not None and not same
        self._all = restored.states if restored is not None and same else (started,)

    @property
    def now(self) -> CalibrationState:
        """The calibration in force."""
        return self._all[-1]

    @property
    def record(self) -> CalibrationHistory:
        """The history to persist."""
        return CalibrationHistory(states=self._all)

    def status(self) -> InForce:
        """Return the calibration in force, as in the camera's status."""
        now, before = self.now, self._all[-2].names if len(self._all) > 1 else None
        return InForce(
            now=now.names, since_ns=now.since_ns, by=now.by, reason=now.reason, before=before
        )

    def serve(
        self, request: CalibrationRequest, monitor: CameraMonitor, now_ns: int
    ) -> CameraMonitor:
        """Put a requested calibration in force; return the monitor of the camera from now on.

        Args:
            request: What to put in force.
            monitor: Of the present camera.
            now_ns: The present time.

        Raises:
            UnsureError: Its poses would be flagged `unsure`, and the request does not accept that.
            EyeError: It cannot be put in force, in words; the present calibration stays.
        """
        if request.verb == "back":
            return self._back(request, monitor, now_ns)
        new = self._requested(request, now_ns)
        model, seen = new.model(), monitor.tags_seen(now_ns)
        _refuse_misfit(model, monitor.estimator.map_tags, seen)
        monitor = _monitored(model, monitor, seen)
        if not request.accept_unsure:
            _refuse_unsure(monitor.estimator)
        first, *later = *self._all, new
        self._all = (first, *later[1 - MAX_STATES :])
        return monitor

    def _back(
        self, request: CalibrationRequest, monitor: CameraMonitor, now_ns: int
    ) -> CameraMonitor:
        if len(self._all) == 1:
            raise EyeError(
                f"camera {self.now.camera.name!r}: nothing to restore: the calibration is the "
                "one at the start"
            )
        *others, before, _ = self._all
        facts = {"since_ns": now_ns, "by": request.by, "reason": request.reason}
        self._all = (*others, msgspec.structs.replace(before, **facts))
        return _monitored(self.now.model(), monitor, monitor.tags_seen(now_ns))

    def _requested(self, request: CalibrationRequest, now_ns: int) -> CalibrationState:
        now, name = self.now, request.calibration
        if request.place is not None:
            camera, names = _placed(now.camera, request.place), Calibrated(place=name)
            lens_covariance = _lens_covariance(camera, request.lens)
        elif request.lens is not None:
            lens = _checked(request.lens)
            camera = calibrated(now.camera, lens)
            names, lens_covariance = msgspec.structs.replace(now.names, lens=name), lens.covariance
        else:
            raise EyeError("calibration: expected a lens or a place to use, got neither")
        return CalibrationState(
            camera=camera, lens_covariance=lens_covariance, names=names,
            since_ns=now_ns, by=request.by, reason=request.reason,
        )  # fmt: skip


def started(camera: Camera, lens: Calibration | None) -> CalibrationState:
    """Return the calibration of a camera at its start."""
    if lens is None:
        return CalibrationState(camera=camera)
    return CalibrationState(camera=calibrated(camera, lens), lens_covariance=lens.covariance)


def _placed(camera: Camera, place: Camera) -> Camera:
    """Return a camera at a located place, with its sensor unchanged."""
    if place.name != camera.name:
        raise EyeError(f"place: expected one of camera {camera.name!r}, got one of {place.name!r}")
    has, got = (f"{one.width_px} x {one.height_px}" for one in (camera, place))
    if has != got:
        raise EyeError(
            f"camera {camera.name!r}: expected a place found in frames of {has} px, got {got} px"
        )
    same = {name: getattr(camera, name) for name in _OF_THE_SENSOR}
    return msgspec.structs.replace(place, **same)


def _lens_covariance(
    camera: Camera, lens: MeasuredLens | None
) -> tuple[tuple[float, ...], ...] | None:
    """Return the covariance of the lens that was used to locate a place; None if it has none."""
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
            f"lens: rms_px: expected a residual of at most {most_px:.2f} px at the board's "
            f"points, got {lens.rms_px:.2f} px"
        )
    return msgspec.convert(msgspec.to_builtins(lens), Calibration)


def _monitored(
    model: CameraModel, before: CameraMonitor, seen: Mapping[int, Floats]
) -> CameraMonitor:
    """Return a monitor of the camera in force, with the tags' present corners."""
    monitor = CameraMonitor(ExtrinsicsEstimator(model, before.estimator.map_tags))
    if before.estimator.seen_ns is not None:
        monitor.estimator.see(seen, before.estimator.seen_ns)
    return monitor


def _refuse_misfit(
    model: CameraModel, map_tags: Sequence[MapTag], seen: Mapping[int, Floats]
) -> None:
    """Refuse a camera that does not explain where the floor's tags are seen now."""
    name, tags = model.camera.name, [tag for tag in map_tags if tag.tag_id in seen]
    if not tags:
        wanted = ", ".join(str(tag.tag_id) for tag in map_tags)
        raise EyeError(
            f"camera {name!r}: expected a map tag ({wanted}) in view to check the calibration by, "
            "sees none now"
        )
    trial = CameraMonitor(ExtrinsicsEstimator(model, tuple(map_tags)))
    off = [seen[tag.tag_id] - trial.estimator.expected(tag) for tag in tags]
    off_px, sigmas = (
        math.sqrt(2.0 * np.mean(np.square(off))),
        trial.estimator.deviation_sigmas(seen),
    )
    elsewhere = trial.misplaced(seen)
    if sigmas > KNOCKED_SIGMAS or elsewhere:
        raise EyeError(
            f"camera {name!r}: map tags are {off_px:.1f} px from where this calibration puts them, "
            f"{sigmas:.0f} standard deviations (at most {KNOCKED_SIGMAS:.0f})"
            + "".join(f"; {words}" for words in elsewhere.values())
        )


def _refuse_unsure(estimator: ExtrinsicsEstimator) -> None:
    """Refuse a camera whose poses the monitor would flag, given its map tags."""
    std_m = estimator.max_position_std_m()
    if std_m > MAX_STD_M:
        raise UnsureError(
            f"camera {estimator.model.camera.name!r}: poses with this calibration would be "
            f"accurate to {2e3 * std_m:.0f} mm only (at most {2e3 * MAX_STD_M:.0f} mm): the "
            "Eye would flag them as unsure and guarded cars would stop; locate it with more tags, "
            "far apart, or put it in force anyway with accept_unsure"
        )


def description(camera: str, in_force: InForce) -> str:
    """Return in one sentence which calibration is in force, by whom and why."""
    names = {"lens": in_force.now.lens, "place": in_force.now.place}
    what = " and ".join(f"{kind} {name}" for kind, name in names.items() if name)
    why = f": {in_force.reason}" if in_force.reason else ""
    return f"camera {camera} uses {what or 'the map file again'}, by {in_force.by}{why}"
