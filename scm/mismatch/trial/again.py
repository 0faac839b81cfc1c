"""Judges a patched car on another drive of the same car: free runs against the recording."""

from dataclasses import dataclass
from pathlib import Path

from scm.errors import ScmError
from scm.mismatch.effect_catalogue import terms_needed
from scm.mismatch.trial.continuous import position_error
from scm.mismatch.trial.known import is_measure, parameters_of
from scm.mismatch.trial.labels import Case, Label
from scm.mismatch.validate.found_car import on
from scm.recording.read import Recording, read_recordings
from scm.vehicles.car import Car, load_car
from scm.vehicles.sensor_correction import without_faults

SHIFT, POINT = "com_shift.shift_m", "measure.pose_point_x_m"
SHOWS = 1.2  # where the nominal car's error is below this times the true car's, nothing is to gain
# Effects whose number stands beside one that ordinary cars have already.
ADDED = {"rolling_resistance", "viscous_drag", "aero_drag"}


@dataclass(frozen=True, slots=True)
class Ratio:
    """Root mean square of free runs' position errors on the other drive [m].

    Attributes:
        true_m: Of the car with what was really concealed; None for laws outside the library.
        retuned_m: Of the car whose ordinary numbers alone were fitted; None where none was kept.
    """

    case: str
    nominal_m: float
    found_m: float
    true_m: float | None
    retuned_m: float | None = None


def compare(case: Case, label: Label, folder: Path) -> Ratio | None:
    """Return the three cars' errors; None without a patched car, or where the effect does not show.

    Args:
        case: With its other drive.
        label: Opened.
        folder: Where the diagnosis wrote `car.toml`, and `retuned.toml` if it likes: the car with
            its ordinary numbers fitted and no effect added.
    """
    patched = folder / "car.toml"
    if not label.names or not patched.is_file() or not case.again.is_dir():
        return None
    recording = read_recordings(case.again)[0]
    base = _ready(load_car(label.car))
    nominal = error(recording, base)
    found = error(recording, on(base, load_car(patched)))
    cars = true_cars(base, label)
    true = min((error(recording, car) for car in cars), default=None)
    if true is not None and nominal < SHOWS * true:
        return None
    retuned = folder / "retuned.toml"
    tuned = error(recording, on(base, load_car(retuned))) if retuned.is_file() else None
    return Ratio(case.name, nominal, found, true, tuned)


def error(recording: Recording, car: Car) -> float:
    """Return the root mean square position error of free runs [m], faults of measurement undone."""
    return position_error(without_faults(recording, car.faults), car)


def true_cars(base: Car, label: Label) -> list[Car]:
    """Return the car as it really was; empty where the library cannot say so.

    Two where a shifted centre of gravity may have taken the measured point with it.
    """
    if label.kind == "unlisted" or not all(map(parameters_of, label.names)):
        return []
    values = dict(label.ordinary)
    values |= {"drive.axle_lock": 1.0} if base.has("drive.axle_lock") else {}
    faults: dict[str, float] = {}
    for name, parameters in zip(label.names, label.parameters, strict=True):
        numbers = {parameters_of(name)[key].key: value for key, value in parameters.items()}
        if name == "wheel_radius":
            values["wheel.radius_m"] = base.value("wheel.radius_m") * parameters["scale"]
        elif is_measure(name):
            faults |= numbers
        elif name in ADDED:
            values |= {key: base.value(key) + more for key, more in numbers.items()}
        else:
            values |= numbers
    measures = [name for name in label.names if is_measure(name) and name != "wheel_radius"]
    try:
        car = base.with_terms([], values)
        car = car.with_measures(measures, faults) if measures else car
    except ScmError:
        return []
    shift = values.get(SHIFT)
    if shift is None:
        return [car]
    return [car, car.with_measures([*measures, "pose_point"], faults | {POINT: shift})]


def _ready(car: Car) -> Car:
    """Return a car with every effect at rest: all cars of one type then share one kernel."""
    return car.with_terms([*terms_needed(car), "drive_delay", "steer_delay"])
