"""Made-up diagnoses with evidence that looks as a real one does, for the tests of the report."""

import dataclasses
import tempfile
from pathlib import Path

import msgspec
import numpy as np

from scm.data_quality.quality import DataProblem
from scm.mismatch.evidence import Curve, Evidence, FreeRuns, RefittedParameter, Residual, Tried
from scm.mismatch.findings import (
    Alternative,
    Diagnosis,
    Effect,
    Equation,
    Estimate,
    Fit,
    Located,
    PartErrors,
    Place,
    Range,
    Unanswered,
    Undecided,
    Verdict,
    Witness,
)
from scm.mismatch.validate.witness import NAMES
from scm.vehicles.car import load_car
from scm.vehicles.describe_effects import all_effects
from scm.vehicles.own_term import load_own_term

OWN_LAW = '''"""Drive force against heading: something pulls the car one way, more at one heading.

    force_x += -strength * sin(2 * yaw)    [N]

Holds: this floor.   Shows in: circles.   Source: found by scm mismatch.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Param
from scm.vehicles.term import Per, Term


@kernel_function
def drive_force_against_heading(cos_yaw: float, sin_yaw: float, strength: float) -> float:
    """Force along the car [N]."""
    return -strength * 2.0 * sin_yaw * cos_yaw


TERM = Term(
    drive_force_against_heading,
    per=Per.BODY,
    adds="force_x",
    neutral={"strength": 0.0},
    shows_in=("circle",),
    params=(
        Param("strength", 0.0, "N", "drive_force_against_heading.strength_n", (-20.0, 20.0),
              "amplitude over twice the heading"),
    ),
)
'''


def replace(record, **changes):
    """Return a record with changes, a struct or a dataclass."""
    change = dataclasses.replace if dataclasses.is_dataclass(record) else msgspec.structs.replace
    return change(record, **changes)


def estimate(value, unit="1", spread=0.1):
    half = spread * abs(value) or spread
    return Estimate(value=value, low=value - half, high=value + half, unit=unit)


def lag():
    return Effect(
        name="drive_lag",
        is_known=True,
        equation=Equation.DRIVE,
        depends_on=("throttle", "time"),
        parameters={"time_constant_s": estimate(0.142, "s")},
        probability=0.973,
        text="The motor's force follows the throttle with a lag of 0.14 s. The simulator lets it "
        "follow at once.",
        alternatives=(
            Alternative(
                name="drive_delay",
                probability=0.021,
                ruled_out_by="The force starts to rise at once and not after a pause.",
            ),
            Alternative(
                name="battery_sag",
                probability=0.0004,
                ruled_out_by="The error does not grow with time.",
            ),
        ),
    )


def patch():
    return Effect(
        name="surface_patch",
        is_known=True,
        equation=Equation.SURFACE,
        depends_on=("x", "y"),
        parameters={
            "x_m": estimate(1.1, "m", 0.02),
            "y_m": estimate(-0.85, "m", 0.04),
            "radius_m": estimate(0.35, "m"),
            "grip": estimate(0.46),
            "rolling": estimate(0.06),
        },
        probability=0.91,
        text="On a round spot of 0.35 m the floor is slippery and slows the wheels.",
        alternatives=(
            Alternative(
                name="grade", probability=0.05, ruled_out_by="Elsewhere the floor is level."
            ),
        ),
    )


def unlisted():
    return Effect(
        name="drive force against heading",
        is_known=False,
        equation=Equation.DRIVE,
        depends_on=("heading",),
        parameters={"strength": estimate(0.42, "N")},
        probability=0.94,
        text="Something pulls on the car with up to 0.42 N, depending on where it heads.",
        formula="F = -0.42 N · sin(2 · heading)",
        recorded_range={"heading": Range(low=-1.2, high=2.4, unit="rad")},
        alternatives=(
            Alternative(name="wind", probability=0.03, ruled_out_by="It turns twice in a circle."),
        ),
    )


def errors(position_m, yaw_rad, speed_mps=0.05):
    return {"position_m": position_m, "yaw_rad": yaw_rad, "speed_mps": speed_mps}


def part(windows, before, after):
    return PartErrors(
        windows=windows,
        before=errors(before, before / 2),
        after=errors(after, after / 2, 0.01),
        noise_floor=errors(0.006, 0.004, 0.004),
    )


def bicycle(position_m=0.093):
    numbers = dict(zip(NAMES, (0.52, -0.021, 0.18, 0.3, 1.1, 0.05, 0.08, 0.4), strict=True))
    return Witness(position_m=position_m, yaw_rad=position_m / 2, numbers=numbers)


def fit(before=0.361, after=0.042, **more):
    return Fit(
        horizon_s=3.0,
        fit=part(14, before * 1.05, after * 0.95),
        choose=part(8, before * 0.93, after * 1.02),
        confirm=part(8, before, after),
        **{"witness": bicycle(), **more},
    )


def drive(seconds=90.0, rate_hz=30.0):
    t = np.arange(0.0, seconds, 1.0 / rate_hz)
    phase = 2 * np.pi * t / 24.0
    x = 1.6 * np.sin(phase) + 0.02 * np.sin(0.31 * t)
    y = 0.9 * np.sin(2 * phase) + 0.015 * np.cos(0.23 * t)
    return t, x, y


def residual(channel, unit, force, seed=1, seconds=90.0):
    """A residual whose signal is `force(t, x, y)`."""
    rng = np.random.default_rng(seed)
    t, x, y = drive(seconds)
    signal = force(t, x, y)
    size = float(np.abs(signal).max()) or 1.0

    def noise():
        smooth = np.convolve(rng.normal(size=len(t)), np.ones(25) / 25, "same")
        return 0.12 * size * smooth / smooth.std()

    std = np.full(len(t), 0.13 * size)
    return Residual(
        channel=channel,
        unit=unit,
        t_s=t,
        x_m=x,
        y_m=y,
        before=signal + noise(),
        after=noise(),
        std=std,
    )


def free_runs(before=0.36, after=0.042, windows=30, seed=3):
    rng = np.random.default_rng(seed)
    t_all, x_all, y_all = drive(3.0 * windows + 3.0)
    t = np.arange(0.0, 3.0001, 0.05)
    start = 3.0 * np.arange(windows)
    clock = start[:, None] + t
    x, y = np.interp(clock, t_all, x_all), np.interp(clock, t_all, y_all)
    yaw = np.arctan2(np.gradient(y, axis=1), np.gradient(x, axis=1))
    grow = (t / 3.0) ** 1.6

    def strayed(size):
        along = size * rng.normal(1.0, 0.35, windows)[:, None] * grow
        aside = 0.3 * size * rng.normal(0.0, 1.0, windows)[:, None] * grow
        turned = 0.5 * size * rng.normal(0.0, 1.0, windows)[:, None] * grow
        return {
            "x": x - along * np.cos(yaw) - aside * np.sin(yaw),
            "y": y - along * np.sin(yaw) + aside * np.cos(yaw),
            "yaw": yaw + turned,
        }

    measured = {
        "x": x + rng.normal(0, 0.002, x.shape),
        "y": y + rng.normal(0, 0.002, x.shape),
        "yaw": yaw,
    }
    measured["x"][4, 20:30] = np.nan
    block = ("fit", "fit", "choose", "fit", "confirm")
    parts = tuple(block[(i // 3) % 5] for i in range(windows))
    return FreeRuns(
        part=parts,
        recording=np.zeros(windows, dtype=np.int64),
        stamp_s=start,
        start_s=start,
        t_s=t,
        measured=measured,
        before=strayed(before),
        after=strayed(after),
    )


def refitted():
    rows = (
        ("body.mass_kg", 2.4, 0.15, 2.43, 0.11, "kg"),
        ("drive.stall_torque_nm", 0.3, 0.03, 0.325, 0.02, "N*m"),
        ("drive.no_load_speed_rad_s", 9.18, 0.05, 9.16, 0.04, "rad/s"),
        ("wheel.damping_linear_nms", 5e-4, 1e-4, 5.9e-4, 8e-5, "N*m*s"),
        ("steering.rate_rad_s", 0.42, 0.05, 0.405, 0.01, "rad/s"),
        ("body.cog_to_rear_axle_m", 0.0708, 0.004, 0.0712, 0.006, "m"),
    )
    return tuple(
        RefittedParameter(
            key=key,
            given=given,
            given_std=std,
            found=Estimate(value=v, low=v - half, high=v + half, unit=unit),
        )
        for key, given, std, v, half, unit in rows
    )


def tried(found=(), strongest=9.0, seed=5):
    rng = np.random.default_rng(seed)
    gains = {name: float(rng.exponential(0.25 * strongest)) for name in all_effects()}
    gains |= {name: 1480.0 / (i + 1) for i, name in enumerate(found)}
    if "drive_lag" in found:
        gains["drive_delay"] = 1130.0
    return tuple(
        Tried(
            name=n, gain=min(g, strongest) if n not in {*found, "drive_delay"} else g, needed=15.2
        )
        for n, g in gains.items()
    )


def curve(effect="drive_lag"):
    x = np.linspace(0.0, 0.6, 60)
    y = 1.0 - np.exp(-x / 0.142)
    return Curve(
        effect=effect,
        x_name="time since the throttle rose",
        x_unit="s",
        y_name="share of the force",
        y_unit="1",
        x=x,
        y=y,
        low=y - 0.05,
        high=y + 0.05,
    )


def evidence(**more):
    shown = {
        "vehicle": "nigel",
        "recordings": ("recordings/tuesday/recording.yaml",),
        "residuals": (
            residual("drive force", "N", lambda t, x, y: 0.6 * np.sin(2 * np.pi * t / 7.0)),
            residual("yaw moment", "N*m", lambda t, x, y: 0.004 * np.sin(t / 9), 2),
        ),
        "free_runs": free_runs(),
        "refitted": refitted(),
        "tried": tried(),
    }
    return Evidence(**{**shown, **more})


def diagnosis(**more):
    shown = {
        "verdict": Verdict.NONE,
        "located": (),
        "effects": (),
        "undecided": (),
        "fit": fit(),
        "runtime_s": 41.7,
        "data": (),
    }
    return Diagnosis(**{**shown, **more})


def one_effect():
    nigel = load_car("nigel")
    located = Located(
        equation=Equation.DRIVE,
        channels=("pose.x", "pose.y", "encoder.left"),
        depends_on=("throttle",),
        when_s=None,
        where=None,
        share_of_error=0.93,
    )
    problem = DataProblem(
        channel="pose.*",
        name="clock_offset",
        text="Poses are stamped 41 ms late against the gyro.",
        corrected="all poses were moved by 41 ms",
    )
    found = diagnosis(
        verdict=Verdict.MISMATCH, located=(located,), effects=(lag(),), data=(problem,)
    )
    shown = evidence(curves=(curve(),), tried=tried(["drive_lag"]))
    return found, shown, nigel, nigel.with_terms(["drive_lag"], {"drive.lag_s": 0.142})


def pair():
    nigel = load_car("nigel")
    spot = Place(x_m=(0.75, 1.45), y_m=(-1.2, -0.5))
    located = (
        Located(
            equation=Equation.DRIVE,
            channels=("pose.x", "pose.y"),
            depends_on=("throttle",),
            when_s=None,
            where=None,
            share_of_error=0.58,
        ),
        Located(
            equation=Equation.SURFACE,
            channels=("pose.x", "pose.y", "pose.yaw"),
            depends_on=("x", "y"),
            when_s=((7.7, 10.2), (31.7, 34.2), (55.7, 58.2), (79.7, 82.2)),
            where=spot,
            share_of_error=0.35,
        ),
    )

    def inside(t, x, y):
        return -1.4 * (np.hypot(x - 1.1, y + 0.85) < 0.35) + 0.25 * np.sin(2 * np.pi * t / 7.0)

    found = diagnosis(verdict=Verdict.MISMATCH, located=located, effects=(lag(), patch()))
    shown = evidence(
        residuals=(
            residual("drive force", "N", inside),
            residual("yaw moment", "N*m", lambda t, x, y: 0.02 * np.sin(t / 2) * (x > 0.4), 2),
            residual("side force", "N", lambda t, x, y: 0.1 * np.cos(t / 5), 4),
        ),
        curves=(
            curve(),
            replace(
                curve("surface_patch"),
                x_name="distance from the spot's centre",
                x_unit="m",
                y_name="grip",
            ),
        ),
        tried=tried(["drive_lag", "surface_patch"]),
    )
    numbers = {
        "drive.lag_s": 0.142,
        "surface_patch.x_m": 1.1,
        "surface_patch.y_m": -0.85,
        "surface_patch.radius_m": 0.35,
        "surface_patch.grip": 0.46,
    }
    return found, shown, nigel, nigel.with_terms(["drive_lag", "surface_patch"], numbers)


def none():
    nigel = load_car("nigel")
    calm = fit(0.0082, 0.0081)
    shown = evidence(
        residuals=(residual("drive force", "N", lambda t, x, y: 0.0 * t),),
        free_runs=free_runs(0.008, 0.008),
    )
    return diagnosis(fit=calm), shown, nigel, nigel


def cut_short():
    """Nothing was found in too short a time."""
    found, *others = none()
    late = "was not sought to the end: the budget of 60 s ended."
    unanswered = (
        Unanswered(name="effects", text=f"What the library holds {late}"),
        Unanswered(name="laws", text=f"What it does not hold {late}"),
    )
    return replace(found, unanswered=unanswered), *others


def undecided():
    nigel = load_car("nigel")
    question = Undecided(
        between=("motor_gain", "payload"),
        drive_this="Put a known mass of 0.5 kg on the car and repeat the drive, or drive up a ramp "
        "of 5 degrees with throttle 0.6 and let it roll back.",
        expected_separation=6.4,
    )
    problem = DataProblem(
        channel="imu.*",
        name="missing",
        text="The recording has no IMU.",
        record_instead="The gyro, at 50 Hz or more.",
    )
    found = diagnosis(
        verdict=Verdict.UNDECIDED, undecided=(question,), fit=fit(0.18, 0.03), data=(problem,)
    )
    return found, evidence(tried=tried(["motor_gain", "payload"])), nigel, nigel


def unlisted_law(folder=None):
    folder = Path(folder or tempfile.mkdtemp())
    (folder / "drive_force_against_heading.py").write_text(OWN_LAW)
    term = load_own_term(folder, "drive_force_against_heading.py")
    nigel = load_car("nigel")
    located = Located(
        equation=Equation.DRIVE,
        channels=("pose.x", "pose.y"),
        depends_on=("heading",),
        when_s=None,
        where=None,
        share_of_error=0.88,
    )
    heading = np.linspace(-180.0, 180.0, 90)
    force = -0.42 * np.sin(2 * np.radians(heading))
    shape = Curve(
        effect="drive force against heading",
        x_name="heading",
        x_unit="°",
        y_name="drive force",
        y_unit="N",
        x=heading,
        y=force,
        low=force - 0.06,
        high=force + 0.06,
    )
    found = diagnosis(verdict=Verdict.MISMATCH, located=(located,), effects=(unlisted(),))
    shown = evidence(curves=(shape,), tried=tried(strongest=60.0))
    key = "drive_force_against_heading.strength_n"
    return found, shown, nigel, nigel.with_terms([term], {key: 0.42})


def bad_data():
    nigel = load_car("nigel")
    problems = (
        DataProblem(
            channel="command.throttle",
            name="missing",
            text="The recording holds no throttle command.",
            record_instead="The command as it is sent to the motor, with its time.",
        ),
        DataProblem(
            channel="pose.x",
            name="gap",
            text="Poses are missing for 2.1 s.",
            when_s=((12.0, 14.1),),
            record_instead="Keep the tag in the camera's sight.",
        ),
        DataProblem(
            channel="imu.gyro_z",
            name="unit",
            text="The gyro is in degrees a second.",
            corrected="divided by 57.3",
        ),
    )
    found = diagnosis(fit=None, data=problems, runtime_s=0.8)
    return found, Evidence(vehicle="nigel", recordings=("broken.yaml",)), nigel, nigel


CASES = {
    "one_effect": one_effect,
    "pair": pair,
    "none": none,
    "cut_short": cut_short,
    "undecided": undecided,
    "unlisted_law": unlisted_law,
    "bad_data": bad_data,
}
