"""Statuses of watched cars: one that was searched and adopted, one undecided, one blind."""

from msgspec.structs import replace

from scm.clock import NS_PER_S
from scm.records.twins import (
    TwinCause,
    TwinChange,
    TwinDrive,
    TwinEffect,
    TwinError,
    TwinParameter,
    TwinVersion,
)
from scm.v2x.messages.twin_status import TwinStatus

NOW_NS = 1200 * NS_PER_S
TRIM = TwinParameter(name="offset_rad", value=-0.031, low=-0.0334, high=-0.0288, before=0.0)
NAMED = TwinEffect(
    name="steer_trim", probability=0.9995, parameters=(TRIM,),
    text="The front wheels point 1.8° to the right when the steering is centred.",
)  # fmt: skip
QUESTION = "Drive a circle to the left at full steering, then the same faster."


def change(at_s, now_ns=NOW_NS, **more):
    """Return a change at a time [s] of a city whose time is 1200 s at `now_ns`."""
    since_ns = now_ns - NOW_NS + at_s * NS_PER_S
    known = {
        "noticed_ns": since_ns + 14 * NS_PER_S, "since_ns": since_ns,
        "since_low_ns": since_ns - NS_PER_S, "since_high_ns": since_ns + 2 * NS_PER_S,
        "effect": "steer_trim", "parameter": "offset_rad", "size": -0.0246, "unit": "rad",
        "score": 30.0, "alike": ("gyro_bias",),
    }  # fmt: skip
    return TwinChange(**known | more)


ORIGINAL = TwinVersion(number=0, car="nigel", file="nigel", made_ns=0, state="adopted")


ABILITIES = tuple(
    TwinParameter(name=name, value=value, low=low, high=high, unit=unit, before=before)
    for name, unit, value, low, high, before in (
        ("cruise_mps", "m/s", 0.2141, 0.2078, 0.2185, 0.2145),
        ("stopping_m", "m", 0.0067, 0.0054, 0.0081, 0.0068),
        ("turning_radius_m", "m", 0.2811, 0.2711, 0.2873, 0.2493),
    )
)


def versions(now_ns=NOW_NS):
    """Return the file that a car came with, the one in force, and a candidate."""
    errors = (
        TwinError(name="position_m", before=0.041, now=0.0182),
        TwinError(name="yaw_rad", before=0.092, now=0.031),
        TwinError(name="speed_mps", before=0.021, now=0.0205),
    )
    return (
        replace(ORIGINAL, state="replaced"),
        TwinVersion(
            number=1, car="nigel", file="runs/twins/n1/1.toml", made_ns=now_ns - 700 * NS_PER_S,
            state="adopted", effects=("steer_trim",), by="twin", windows=38, errors=errors,
            reason="position better on new driving: position 41 to 18.2 mm, "
            "heading 92 to 31 mrad after 3 s, 38 windows", report="twin-n1-300",
            abilities=ABILITIES,
        ),
        TwinVersion(
            number=2, car="nigel", file="runs/twins/n1/2.toml", made_ns=now_ns - 60 * NS_PER_S,
            state="candidate", after=1, effects=("tyre_grip",),
        ),
    )  # fmt: skip


def watched(vehicle="n1", now_ns=NOW_NS, **more):
    """Return a car that changed twice: a named change, and one that is still searched for."""
    known = {
        "t_ns": now_ns, "car": "nigel", "state": "watching", "driven_s": 1104.26,
        "changes": (
            change(300, now_ns, search="named", effects=(NAMED,), text=NAMED.text,
                   report="twin-n1-300"),
            change(1130, now_ns, effect="tyre_grip", parameter="scale", size=-0.12, unit="1",
                   alike=(), search="searching", report="twin-n1-1130"),
        ),
        "version": 1, "versions": versions(now_ns),
    }  # fmt: skip
    return TwinStatus(vehicle=vehicle, **known | more)


def undecided(vehicle="n2", now_ns=NOW_NS, **drive):
    """Return a car whose change two effects explain alike, and whose it is n1 would decide."""
    found = change(
        480, now_ns, search="undecided", between=("steer_trim", "gyro_bias"), drive_this=QUESTION,
        text="It may be steer_trim or gyro_bias.", report="twin-n2-480",
        causes=(
            TwinCause(kind="car", probability=0.62),
            TwinCause(kind="everywhere", probability=0.34),
            TwinCause(kind="camera", probability=0.04),
        ),
        decide_by=f"Let n1 drive through (1.2, 0.4), and {vehicle} elsewhere.",
        drive=TwinDrive(**{"vehicle": "n1", "x_m": 1.2, "y_m": 0.4,
                           "t_ns": now_ns - 20 * NS_PER_S} | drive),
    )  # fmt: skip
    return watched(vehicle, now_ns, changes=(found,), version=0, versions=(ORIGINAL,))


def floor_changed(vehicle="n4", now_ns=NOW_NS):
    """Return a car that noticed a patch of the floor."""
    place = TwinCause(kind="place", probability=0.973, x_m=1.2, y_m=0.4, radius_m=0.3)
    found = change(
        900, now_ns, effect="rolling_resistance", parameter="coefficient", size=0.012, unit="1",
        alike=(), search="elsewhere", cause="place", causes=(place,),
    )  # fmt: skip
    return watched(vehicle, now_ns, changes=(found,), version=0, versions=(ORIGINAL,))


def blind(vehicle="n3", now_ns=NOW_NS):
    """Return a car that cannot be watched."""
    reason = "no command that it obeyed is known"
    return watched(
        vehicle, now_ns, state="blind", reason=reason, driven_s=0.0, changes=(), version=0,
        versions=(ORIGINAL,),
    )  # fmt: skip
