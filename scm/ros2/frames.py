"""Coordinate frames named as in REP-105; axes are those of ISO 8855, which REP-103 shares.

    map -> <car>/odom -> <car>/base_link -> <car>/laser, /imu, /camera -> <car>/camera_optical

`base_link` is the centre of the rear axle on the floor. `odom` is where the car was first seen: in
it the car moves by dead reckoning, without jumps but with drift; `map -> odom` holds the correction
from the car's pose on the map (indoor position, the Eye). `camera_optical` looks along its z.
"""

import math
from typing import Any

from scm.clock import seconds
from scm.geometry import Pose2
from scm.ros2.types import ros
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import Car

MAP = "map"
_OPTICAL = (-math.pi / 2.0, 0.0, -math.pi / 2.0)

Turn = tuple[float, float, float]
"""Roll, pitch and yaw [rad], in the order yaw, pitch, roll about the turned axes."""


class DeadReckoning:
    """Dead reckoning of a car: its own motion integrated from where it was first seen."""

    def __init__(self) -> None:
        self.odom_T_base = Pose2(0.0, 0.0, 0.0)
        self._before: VehicleState | None = None

    def step(self, state: VehicleState) -> Pose2:
        """Integrate to a newer state by the mean of both motions; return odom_T_base.

        A state that is not newer, as after a restart of its sender, adds no motion.
        """
        before, self._before = self._before, state
        if before is not None and state.t_ns > before.t_ns:
            half = 0.5 * seconds(state.t_ns - before.t_ns)
            turned = half * (before.yaw_rate_radps + state.yaw_rate_radps)
            ahead = half * (before.speed_mps + state.speed_mps)
            aside = half * (before.lateral_speed_mps + state.lateral_speed_mps)
            here = self.odom_T_base @ Pose2(0.0, 0.0, 0.5 * turned)
            self.odom_T_base = here @ Pose2(ahead, aside, 0.5 * turned)
        return self.odom_T_base


def time(t_ns: int) -> Any:
    """Return a time stamp."""
    sec, nanosec = divmod(t_ns, 1_000_000_000)
    return ros("builtin_interfaces/Time", sec=sec, nanosec=nanosec)


def header(t_ns: int, frame: str) -> Any:
    """Return the header of a message: time and frame."""
    return ros("std_msgs/Header", stamp=time(t_ns), frame_id=frame)


def vector(x: float, y: float, z: float = 0.0) -> Any:
    """Return a vector."""
    return ros("geometry_msgs/Vector3", x=x, y=y, z=z)


def point(x: float, y: float, z: float = 0.0) -> Any:
    """Return a point [m]."""
    return ros("geometry_msgs/Point", x=x, y=y, z=z)


def quaternion(turn: Turn) -> Any:
    """Return a rotation."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(0.5 * a), math.sin(0.5 * a)) for a in turn)
    return ros(
        "geometry_msgs/Quaternion",
        x=sr * cp * cy - cr * sp * sy,
        y=cr * sp * cy + sr * cp * sy,
        z=cr * cp * sy - sr * sp * cy,
        w=cr * cp * cy + sr * sp * sy,
    )


def pose(at: Pose2, z: float = 0.0) -> Any:
    """Return a pose at height `z` above the floor."""
    place = point(at.x, at.y, z)
    turn = quaternion((0.0, 0.0, at.yaw))
    return ros("geometry_msgs/Pose", position=place, orientation=turn)


def transform(
    t_ns: int, parent: str, child: str, at: tuple[float, float, float], turn: Turn = (0.0, 0.0, 0.0)
) -> Any:
    """Return parent_T_child: the child's origin and rotation in the parent's frame."""
    moved = ros("geometry_msgs/Transform", translation=vector(*at), rotation=quaternion(turn))
    head = header(t_ns, parent)
    return ros("geometry_msgs/TransformStamped", header=head, child_frame_id=child, transform=moved)


def moving(t_ns: int, parent: str, child: str, at: Pose2) -> Any:
    """Return parent_T_child of two frames on the floor."""
    return transform(t_ns, parent, child, (at.x, at.y, 0.0), (0.0, 0.0, at.yaw))


def mounts(name: str, car: Car, t_ns: int) -> list[Any]:
    """Return the mounting transforms of the sensors that the car file has."""
    base, out = f"{name}/base_link", []
    for section, frame in (("lidar", "laser"), ("imu", "imu"), ("camera", "camera")):
        if car.has(f"{section}.position_m"):
            x, y, z = car.vector(f"{section}.position_m")
            down = car.value("camera.pitch_down_rad") if section == "camera" else 0.0
            out.append(transform(t_ns, base, f"{name}/{frame}", (x, y, z), (0.0, down, 0.0)))
    if car.has("camera.position_m"):
        camera = f"{name}/camera"
        out.append(transform(t_ns, camera, f"{camera}_optical", (0.0, 0.0, 0.0), _OPTICAL))
    return out
