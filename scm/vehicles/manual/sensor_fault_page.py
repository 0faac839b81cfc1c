"""The page and the picture of one sensor fault: the same drive, true and measured."""

import math
from collections.abc import Iterator

import numpy as np

from scm.geometry import Pose2
from scm.vehicles.car import load_car
from scm.vehicles.fleet import Fleet
from scm.vehicles.manual.line_svg import Line, draw_lines
from scm.vehicles.manual.page_parts import equations, headings, parameter_table, story
from scm.vehicles.manual.shown import strong
from scm.vehicles.sensor_fault import AppliedFault, SensorFault, Series, apply_faults

_EVERY_S = 1.0 / 30.0
_SECONDS = 9.0
_TICKS = 1920 / (2.0 * math.pi)

_NUMBERS = {"unit_error": {"factor": 3.6}}
_SEEN = {"imu_misalignment": "imu.accel_y"}
_TITLES = {
    "imu.accel_y": "acceleration across [m/s²]",
    "imu.accel_x": "acceleration along [m/s²]",
    "imu.gyro_z": "yaw rate [rad/s]",
    "pose.yaw": "heading [rad]",
    "encoder.left": "left encoder [counts]",
    "speed": "speed [m/s]",
}  # fmt: skip


def sensor_fault_page(fault: SensorFault) -> str:
    """Return one fault's page."""
    text = story(fault.function)
    channels = ", ".join(f"`{name}`" for name in fault.acts_on or fault.functions)
    shown = _numbers(fault)
    numbers = ", ".join(f"`{p.key} = {shown[p.name]:g}`" for p in fault.params)
    lines = [f"# {fault.name}", "", fault.about, "", "```", *equations(fault.function), "```", ""]
    lines += [text, ""] if text else []
    lines += [f"![{fault.name}: true and measured]({fault.name}.svg)", ""]
    lines += [f"*nigel swinging slowly; grey: true, blue: as measured with {numbers}.*", ""]
    lines += [*parameter_table(fault.params, fault.neutral), *headings(fault)]
    lines += [f"**Acts on:** the stamps of {channels}" if fault.stamps else
              f"**Acts on:** {channels}", ""]  # fmt: skip
    lines += list(_example(fault))
    code = fault.function.__module__.replace(".", "/")
    lines += [f"Code: `{code}.py` · [all effects](README.md)"]
    return "\n".join(lines) + "\n"


def _example(fault: SensorFault) -> Iterator[str]:
    """Yield an example for a car file."""
    where = " on speed" if fault.acts_on == () else ""
    shown = _numbers(fault)
    yield from ("```toml", f'measures = ["{fault.name}{where}"]', "[measure]")
    for param in fault.params:
        key = param.key.partition(".")[2]
        yield f'{key} = {{ value = {shown[param.name]:g}, source = "..." }}'
    yield from ("```", "")


def draw_sensor_fault(fault: SensorFault) -> str:
    """Return the picture of one fault."""
    true = _drive()
    numbers = _numbers(fault)
    seen = _channel(fault)
    known = {name: series for name, series in true.items() if name != "speed" or seen == "speed"}
    measured = apply_faults(
        known, [AppliedFault(fault, numbers, (seen,) if fault.acts_on == () else ())]
    )
    lines = []
    for label, channels in (("true", true), ("measured", measured)):
        shown = channels[seen]
        x = channels["pose.x"].values if seen == "pose.y" else shown.t_s
        lines.append(Line(label, x, shown.values))
    if seen == "pose.y":
        return draw_lines(lines, "x [m]", "y [m]", equal_scale=True)
    return draw_lines(lines, "time [s]", _TITLES[seen])


def _numbers(fault: SensorFault) -> dict[str, float]:
    chosen = {param.name: strong(param) for param in fault.params}
    return chosen | _NUMBERS.get(fault.name, {})


def _channel(fault: SensorFault) -> str:
    if fault.acts_on == ():
        return "speed"
    if fault.name in _SEEN:
        return _SEEN[fault.name]
    names = list(fault.functions)
    if fault.stamps:
        return "pose.yaw"
    if "pose.y" in names:
        return "pose.y"
    return next((name for name in names if name in _TITLES), "encoder.left")


def _drive() -> dict[str, Series]:
    """Simulate a slow slalom and return its true channels."""
    fleet = Fleet(load_car("nigel"), 1)
    fleet.add(Pose2(0.3, 0.3, 0.5))
    rows = []
    for i in range(round(_SECONDS / _EVERY_S)):
        t = i * _EVERY_S
        rows.append((t, fleet.x[0], fleet.y[0], fleet.yaw[0], fleet.yaw_rate[0], fleet.accel_x[0],
                     fleet.accel_y[0], fleet.wheel_angle[0, 2], fleet.speed[0]))  # fmt: skip
        fleet.throttle[0] = 0.8 if t > 0.5 else 0.0
        fleet.steering[0] = 0.6 * math.sin(1.2 * t)
        fleet.advance(_EVERY_S, _EVERY_S / 33.0)
    t, x, y, yaw, rate, along, across, angle, speed = np.array(rows).T
    counts = np.floor(angle * _TICKS)
    values = {"pose.x": x, "pose.y": y, "pose.yaw": yaw, "imu.gyro_z": rate, "imu.accel_x": along,
              "imu.accel_y": across, "encoder.left": counts, "speed": speed}  # fmt: skip
    return {name: Series(t, series) for name, series in values.items()}
