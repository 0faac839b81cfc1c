"""What a car of a made drive reports whose gyro reads too much from a moment on."""

import numpy as np

from scm.clock import NS_PER_S, nanoseconds
from scm.geometry import wrap_angle
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from tests.unit.mismatch.made_drive import made_drive

BEGAN_NS = 1_700_000_000 * NS_PER_S
EVERY_S = 0.02
SINCE_S, LASTS_S, BIAS = 70.0, 140.0, 0.02
LEARNED, WELL_LEARNED = 80, 120
"""Windows that tests learn from: a drive of two minutes has to do."""


def biased(since_s):
    """Return what biases the gyro from a time on, for `made_drive`."""
    return lambda name, t, values: values + BIAS * (t >= since_s) * (name == "imu.gyro_z")


def changed_drive():
    """Return the drive of a car that changes at `SINCE_S`."""
    return made_drive(seconds=LASTS_S, sense=biased(SINCE_S))


def reports(recording, name="n1", lasts_s=LASTS_S):
    """Return what the car of a recording would report, one list a step of 0.1 s."""
    t = np.arange(0.1, lasts_s - 0.1, EVERY_S)

    def at(channel):
        one = recording.channels[channel]
        values = np.unwrap(one.values) if channel == "pose.yaw" else one.values
        return np.interp(t, one.t, values).tolist()

    x, y, yaw, gyro, left, right, ax, ay = map(at, (
        "pose.x", "pose.y", "pose.yaw", "imu.gyro_z", "encoder.left", "encoder.right",
        "imu.accel_x", "imu.accel_y",
    ))  # fmt: skip
    command = recording.channels["command.throttle"].t
    row = np.searchsorted(command, t - 0.5 * EVERY_S, side="right") - 1
    throttle, steering = (
        recording.channels[f"command.{which}"].values[row].tolist()
        for which in ("throttle", "steering")
    )
    steps = [[]]
    for k, t_s in enumerate(t.tolist()):
        t_ns = BEGAN_NS + nanoseconds(t_s)
        state = VehicleState(
            vehicle=name, t_ns=t_ns, seq=k, x_m=x[k], y_m=y[k], yaw_rad=wrap_angle(yaw[k]),
            speed_mps=0.2, yaw_rate_radps=0.0, steering_rad=0.0, throttle=throttle[k],
            steering=steering[k], source="simulated",
        )  # fmt: skip
        sensors = VehicleSensors(
            vehicle=name, t_ns=t_ns, encoder_left=round(left[k]), encoder_right=round(right[k]),
            accel_mps2=(ax[k], ay[k], 9.81), gyro_radps=(0.0, 0.0, gyro[k]),
        )  # fmt: skip
        steps[-1] += [state, sensors]
        if k % 5 == 4:
            steps.append([])
    return steps
