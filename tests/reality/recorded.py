"""One drive of one car: driven, sensed and written as a recording."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.reality.changing import Changing, at
from tests.reality.driver import DRIVERS
from tests.reality.family import USUAL
from tests.reality.motion import COMMAND_S, ROW_S, Moving
from tests.reality.numbers import file_of, nominal
from tests.reality.routes import TEMPERS, draw_route, draw_speeds
from tests.reality.sensing import POSE_STD, YAW_STD, Camera, encoders, inertial, stated_std

HEAD = """recording: 1
vehicle: {car}
frame: world            # x right, y up on the floor, yaw counter-clockwise from x; pose of the rear-axle centre
tables:
  - file: commands.csv
    time: {{column: t, unit: s}}
    channels:
      command.throttle: {{column: throttle, unit: "1"}}
      command.steering: {{column: steering, unit: "1"}}
  - file: pose.csv
    time: {{column: t, unit: s}}
    channels:
      pose.x:   {{column: x, unit: m, std: {pose:g}}}
      pose.y:   {{column: y, unit: m, std: {pose:g}}}
      pose.yaw: {{column: yaw, unit: rad, std: {yaw:g}}}
"""  # noqa: E501
ENCODERS = """  - file: encoders.csv
    time: {{column: t, unit: s}}
    channels:
      encoder.left:  {{column: left, unit: count}}
      encoder.right: {{column: right, unit: count}}
"""
IMU = """  - file: imu.csv
    time: {{column: t, unit: s}}
    channels:
      imu.accel_x: {{column: ax, unit: m/s^2, std: {accel:g}}}
      imu.accel_y: {{column: ay, unit: m/s^2, std: {accel:g}}}
      imu.gyro_z:  {{column: gz, unit: rad/s, std: {gyro:g}}}
"""
DESCRIPTION = HEAD + ENCODERS + IMU


@dataclass(frozen=True)
class Drive:
    """What was recorded, as tables with a column of time each, and the truth behind it.

    Attributes:
        encoders, imu: None where the car has none.
        rows: What really happened, every 2.5 ms; see `motion.ROW`.
        fastest: Speed that the driver allowed himself [m/s].
        noise: Of the poses, standard deviation relative to the usual one.
    """

    commands: np.ndarray
    poses: np.ndarray
    encoders: np.ndarray | None
    imu: np.ndarray | None
    rows: np.ndarray
    fastest: float
    span: tuple[float, float]
    shape: str
    noise: float = 1.0


def record(car, numbers, faults, duration, rng, moving=Moving, family=USUAL):
    """Let a driver drive a car and return what the sensors saw of it."""
    changing, numbers = numbers, at(numbers, 0.0)
    temper, commands = TEMPERS[car].on_floor(family.floor), round(duration / COMMAND_S)
    sharpest = np.tan(numbers["limit"]) / numbers["base"]
    route = draw_route(temper, sharpest, rng, family.routes)
    target_speeds, fastest = draw_speeds(temper, duration, rng)
    driver = DRIVERS[family.driver](
        temper, route, target_speeds, numbers["base"], numbers["limit"], rng, family.pose_hz
    )
    first, second = route.points[0], route.points[3]
    start = (*first, np.arctan2(*(second - first)[::-1]))
    camera = Camera(faults, car, duration, rng, family)
    least = -1.0 if moving is Moving else moving.least_throttle
    shake = _bursts(commands, rng)
    body = moving(numbers, start, commands, shake)
    rows = np.empty((round(duration / ROW_S), 11))
    done, given = 0, np.empty((commands, 3))
    for k in range(commands):
        t = k * COMMAND_S
        for stamp, pose in camera.look(rows[:done], start, t):
            driver.look(stamp, pose)
        throttle, steering = np.round(driver.act(k), 5)
        throttle = max(throttle, least)
        given[k] = t, throttle, steering
        if isinstance(changing, Changing):
            body.become(changing.at(t))
        new = body.command(k, throttle, steering)
        rows[done : done + len(new)] = new
        done += len(new)
    camera.look(rows, start, duration)
    noise = numbers["accel_noise"], numbers["gyro_noise"]
    wheels = imu = None
    if family.encoder_hz:
        wheels = encoders(rows, faults, numbers["counts"], duration, family.encoder_hz)
    if family.imu_hz:
        imu = inertial(rows, faults, noise, duration, rng, family.imu_hz)
    places, shape = route.points, route.shape
    if family.driver == "open_loop":
        places, shape = rows[:, 1:3], "none"
    return Drive(
        given, camera.table(), wheels, imu, rows, fastest,
        tuple(float(v) for v in np.ptp(places, axis=0)), shape, stated_std(family),
    )  # fmt: skip


def _bursts(commands, rng):
    """Return noise that comes for two seconds in ten, of standard deviation 1, one a command."""
    t = np.arange(commands) * COMMAND_S
    on = (t + rng.uniform(0.0, 10.0)) % 10.0 < 2.0
    return on * rng.standard_normal(commands)


TABLES = (
    ("commands", "t,throttle,steering", ("%.4f", "%.5f", "%.5f")),
    ("poses", "t,x,y,yaw", ("%.4f", "%.5f", "%.5f", "%.5f")),
    ("encoders", "t,left,right", ("%.4f", "%d", "%d")),
    ("imu", "t,ax,ay,gz", ("%.4f", "%.4f", "%.4f", "%.5f")),
)
FILES = {"commands": "commands.csv", "poses": "pose.csv", "encoders": "encoders.csv"}


def write(drive, car, numbers, folder: Path, moving=Moving):
    """Write a drive as a recording that says nothing of what is concealed.

    Where the engine's nominal car is not that of the car's file, `car.toml` beside it says which.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stated = {} if moving is Moving else moving.stated(nominal(car))
    if stated:
        text = file_of(car, stated, moving.terms)
        (folder / "car.toml").write_text(text, encoding="utf-8")
    for name, header, form in TABLES:
        if getattr(drive, name) is None:
            continue
        path = folder / FILES.get(name, f"{name}.csv")
        np.savetxt(path, getattr(drive, name), form, ",", header=header, comments="")
    text = HEAD + ENCODERS * (drive.encoders is not None) + IMU * (drive.imu is not None)
    text = text.format(
        car="car.toml" if stated else car,
        pose=drive.noise * POSE_STD[car], yaw=drive.noise * YAW_STD,
        accel=numbers["accel_noise"], gyro=numbers["gyro_noise"],
    )  # fmt: skip
    (folder / "recording.yaml").write_text(text, encoding="utf-8")
