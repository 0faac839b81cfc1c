"""Sensor effects of the dictionary: an error proportional to something known at each sample.

They need no rollout: what is measured moves, not the car. A likelihood with their signatures
subtracts them from its residuals, so they are fitted beside everything else.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from scm.arrays import Floats
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Equation
from scm.mismatch.fit.hypothesis import Hypothesis
from scm.mismatch.fit.likelihood import Signatures
from scm.mismatch.fit.rollouts import Motions
from scm.replay.drive import STEP_S, Drive

PREFIX = "sensed."
GYROS = ("imu.gyro_z", "yaw_rate")
ENCODERS = ("encoder.left", "encoder.right")
Known = Mapping[str, Floats]
"""What is known on a drive's edges, or an error of each channel there."""
Reads = Callable[[Known], Known]
_SIDES = {"left": "rl", "right": "rr"}


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorEffect(Candidate):
    """An error of a sensor, a candidate like those of the catalogue.

    Attributes:
        formula_text: The error as a formula; braces take its amount.
        reads: What one unit adds to each channel on a drive's edges, from what is known there.
    """

    formula_text: str
    reads: Reads

    @property
    def fault(self) -> str:
        """The key under which a car file has such a fault of measurement; empty: it has none."""
        return IN_FILE.get(self.formula_text, "")

    def formula(self, values: tuple[float, ...]) -> str:
        """Return the formula with its number and unit."""
        unit = "" if self.parameters[0].unit == "1" else f" {self.parameters[0].unit}"
        return self.formula_text.format(f"{values[0]:.3g}{unit}")


LENS = "camera_lens"
IN_FILE: Mapping[str, str] = {
    "measured = true * (1 + {} * |x|)": "measure.camera_lens_x_per_m",
    "measured = true * (1 + {} * |y|)": "measure.camera_lens_y_per_m",
    "measured = true * (1 + {} * (x^2 + y^2))": "measure.camera_lens_per_m2",
}
"""Errors of the camera that are numbers of the sensor fault `LENS`."""
_Row = tuple[str, str, str, str, float, str, str, Reads]


def _gyro(value: Callable[[Known], Floats]) -> Reads:
    return lambda now: dict.fromkeys(GYROS, value(now))


def _pose(scale: Callable[[Known], Floats]) -> Reads:
    return lambda now: {"pose.x": scale(now) * now["x"], "pose.y": scale(now) * now["y"]}


def _counted(share: Callable[[Known], Floats], right: float = 1.0) -> Reads:
    """Return counts lost at a share of the wheels' rate; `right` times as many on the right."""

    def reads(now: Known) -> Known:
        lost = {side: STEP_S * np.cumsum(share(now) * now[f"rate.{side}"]) for side in _SIDES}
        return {"encoder.left": -lost["left"], "encoder.right": -right * lost["right"]}

    return reads


_TABLE: tuple[_Row, ...] = (
    ("camera scale", "position", "per_m", "1/m", 0.002,
     "The camera's scale changes by {per_m} of the distance from the middle along x",
     "measured = true * (1 + {} * |x|)", _pose(lambda now: np.abs(now["x"]))),
    ("camera scale", "position", "per_m", "1/m", 0.002,
     "The camera's scale changes by {per_m} of the distance from the middle along y",
     "measured = true * (1 + {} * |y|)", _pose(lambda now: np.abs(now["y"]))),
    ("camera scale", "position", "per_m2", "1/m^2", 0.002,
     "The camera's scale changes by {per_m2} of the squared distance from the middle",
     "measured = true * (1 + {} * (x^2 + y^2))", _pose(lambda now: now["x"] ** 2 + now["y"] ** 2)),
    ("camera heading", "heading", "offset_rad", "rad", 0.005,
     "The camera's heading is off by {offset_rad}, depending on the heading",
     "measured yaw = true + {} * sin(yaw)", lambda now: {"pose.yaw": np.sin(now["yaw"])}),
    ("camera heading", "heading", "offset_rad", "rad", 0.005,
     "The camera's heading is off by {offset_rad}, depending on the heading",
     "measured yaw = true + {} * cos(yaw)", lambda now: {"pose.yaw": np.cos(now["yaw"])}),
    ("gyro", "acceleration", "per_mps2", "rad*s/m", 0.005,
     "The gyro feels the car's acceleration along: it reads {per_mps2} of it too much",
     "yaw rate = true + {} * acceleration along", _gyro(lambda now: now["accel"])),
    ("gyro", "lateral acceleration", "per_mps2", "rad*s/m", 0.005,
     "The gyro feels the car's acceleration across, whatever its sign: {per_mps2} of it",
     "yaw rate = true + {} * |acceleration across|", _gyro(lambda now: np.abs(now["across"]))),
    ("gyro", "speed", "per_mps", "rad/m", 0.01, "The gyro reads {per_mps} of the speed too much",
     "yaw rate = true + {} * speed", _gyro(lambda now: now["speed"])),
    ("gyro", "yaw rate", "share", "1", 0.01,
     "The gyro's scale differs between left and right by {share} each way",
     "yaw rate = true + {} * |true|", _gyro(lambda now: np.abs(now["turning"]))),
    ("gyro", "throttle", "per_throttle", "rad/s", 0.005,
     "The gyro feels the motors: it reads {per_throttle} too much at full throttle",
     "yaw rate = true + {} * throttle", _gyro(lambda now: now["throttle"])),
    ("encoders", "speed", "per_mps", "s/m", 0.01,
     "The encoders lose more counts the faster the wheels turn: {per_mps} of them",
     "counted = true * (1 - {} * speed)", _counted(lambda now: np.abs(now["speed"]))),
    ("encoders", "side", "share", "1", 0.01,
     "The left encoder loses {share} of its counts and the right one counts as much too many",
     "counted = true * (1 - {}) left, (1 + the same) right",
     _counted(lambda now: np.ones_like(now["time"]), right=-1.0)),
)  # fmt: skip


@cache
def sensor_effects() -> tuple[SensorEffect, ...]:
    """Return every sensor effect that may be tried."""
    return tuple(
        SensorEffect(
            name=f"{channel} against {word}", equation=Equation.SENSOR, depends_on=(word,),
            parameters=(Parameter(parameter, f"{PREFIX}{i}", unit, (-10.0, 10.0), 0.0, step),),
            starts=(), sentence=sentence + ".", formula_text=formula, reads=reads,
        )
        for i, (channel, word, parameter, unit, step, sentence, formula, reads) in enumerate(_TABLE)
    )  # fmt: skip


def signatures_of(base: Hypothesis) -> Signatures:
    """Return what one unit of each sensor effect adds to every stream, where the car drives."""
    model, found = base.model, dict[str, list[list[Floats]]]()
    known = [
        _known(drive, rollouts.run([base.numbers]))
        for drive, rollouts in zip(model.drives, model.simulator.rollouts, strict=True)
    ]
    for effect in sensor_effects():
        parts = [_read(d, effect.reads(now)) for d, now in zip(model.drives, known, strict=True)]
        if any(part.any() for one in parts for part in one):
            found[effect.parameters[0].key] = parts
    return found


def _known(drive: Drive, motion: Motions) -> dict[str, Floats]:
    edges = drive.edges
    x, y, yaw = (drive.smoothed[f"pose.{n}"].at(edges) for n in ("x", "y", "yaw"))
    throttle = drive.throttle.means(edges, np.zeros(1))[:, 0]
    now = {
        "x": x, "y": y, "yaw": yaw, "time": edges - edges[0], "speed": motion["speed"][:, 0],
        "accel": motion["accel_x"][:, 0], "across": motion["accel_y"][:, 0],
        "turning": motion["yaw_rate"][:, 0], "throttle": np.append(throttle, throttle[-1]),
    }  # fmt: skip
    counts = 0.0
    if any(s.name in ENCODERS for s in drive.streams):
        counts = drive.car.value("encoder.counts_per_revolution") / (2.0 * np.pi)
    for side, wheel in _SIDES.items():
        now[f"rate.{side}"] = counts * np.gradient(motion[f"wheel_angle.{wheel}"][:, 0], STEP_S)
    return now


def _read(drive: Drive, reads: Known) -> list[Floats]:
    """Return what each stream reads too much at its samples; zero where it reads right."""
    return [
        np.interp(s.taps, drive.edges, reads[s.name]).mean(axis=1)
        if s.name in reads
        else np.zeros(len(s.t))
        for s in drive.streams
    ]
