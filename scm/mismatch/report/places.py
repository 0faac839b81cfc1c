"""Where, when and in which sensors an error shows, in the words of the report."""

from collections.abc import Sequence

from scm.data_quality.problem import Span
from scm.mismatch.findings import Equation, Located, Place
from scm.mismatch.report.wording import joined, percent, short

PARTS_OF_CAR = {
    Equation.DRIVE: "In the drive",
    Equation.STEERING: "In the steering",
    Equation.TYRE: "In the tyres",
    Equation.BODY: "On the body",
    Equation.SURFACE: "From the floor",
    Equation.SENSOR: "In the measuring",
}
_SENSORS = {  # what a person calls the channels, in the order in which they are listed
    "the whole recording": ("*",),
    "measured position": ("pose.x", "pose.y", "pose.z"),
    "measured heading": ("pose.yaw",),
    "measured tilt": ("pose.roll", "pose.pitch"),
    "poses": ("pose.*",),
    "gyro": ("imu.gyro_x", "imu.gyro_y", "imu.gyro_z"),
    "accelerometer": ("imu.accel_x", "imu.accel_y", "imu.accel_z"),
    "IMU": ("imu.*",),
    "yaw rate": ("yaw_rate",),
    "measured velocity": ("velocity.x", "velocity.y", "velocity.*"),
    "speed": ("speed",),
    "wheel speeds": ("wheel_speed.fl", "wheel_speed.fr", "wheel_speed.rl", "wheel_speed.rr",
                     "wheel_speed.*"),
    "encoders": ("encoder.left", "encoder.right", "encoder.*"),
    "battery voltage": ("battery.voltage", "battery.*"),
    "motor current": ("motor.current", "motor.*"),
    "throttle command": ("command.throttle",),
    "steering command": ("command.steering",),
    "speed command": ("command.speed",),
    "acceleration command": ("command.acceleration",),
    "commands": ("command.*",),
}  # fmt: skip
_SINGLE = {"encoder.left": "left encoder", "encoder.right": "right encoder"}
_ALL_OF_IT = 0.995
_SAYS_NOTHING = ("constant", "wheel")
_MOST_SPANS = 4


def where_and_when(found: Sequence[Located]) -> str:
    """Return where and when the error lies."""
    return " ".join(_one_place(located) for located in found)


def _one_place(located: Located) -> str:
    where = place(located.where) if located.where else "everywhere on the floor"
    when = spans(located.when_s) if located.when_s else "all the time"
    said = f"{PARTS_OF_CAR[located.equation]}, {where}, {when}."
    if located.channels:
        said += f" Shows in {sensors(located.channels)}."
    drivers = [name for name in located.depends_on if name not in _SAYS_NOTHING]
    if drivers:
        said += f" Depends on {joined(drivers)}."
    share = located.share_of_error
    much = "nearly all" if share > _ALL_OF_IT else percent(share)
    return f"{said} It makes {much} of the error."


def place(box: Place) -> str:
    """Return a box of the floor."""
    (x0, x1), (y0, y1) = box.x_m, box.y_m
    return f"at x {short(x0)} to {short(x1)} m, y {short(y0)} to {short(y1)} m"


def spans(when_s: Sequence[Span]) -> str:
    """Return spans of time, the first few by their numbers."""
    shown = [f"{a:.1f} to {b:.1f} s" for a, b in when_s[:_MOST_SPANS]]
    more = len(when_s) - len(shown)
    return "at " + ", ".join(shown) + (f" and {more} more times" if more else "")


def sensors(channels: Sequence[str]) -> str:
    """Return channels as a person would list them, each sensor once; one text may name several."""
    named = {channel: words for words, group in _SENSORS.items() for channel in group}
    channels = [channel for text in channels for channel in text.split(", ")]
    if len(channels) == 1 and channels[0] in _SINGLE:
        return _SINGLE[channels[0]]
    return joined(list(dict.fromkeys(named.get(channel, channel) for channel in channels)))
