"""Conversions of the city's messages to ROS: same times, units and axes."""

import math
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from scm.clock import NS_PER_S, seconds
from scm.errors import MessageError
from scm.geometry import TAU, Pose2
from scm.maps.segments import wall_segments
from scm.records.city_map import CityMap
from scm.ros2.frames import header, pose, quaternion, time, vector
from scm.ros2.types import ros
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState

SCAN_BYTES = 4
MAP_CELL_M, MAP_CELLS, OCCUPIED = 0.05, 1_000_000, 100
_NOT_MEASURED = -1.0


def clock(t_ns: int) -> Any:
    """Return `rosgraph_msgs/Clock`."""
    return ros("rosgraph_msgs/Clock", clock=time(t_ns))


def odometry(name: str, state: VehicleState, at: Pose2) -> Any:
    """Return `nav_msgs/Odometry`: the pose in `odom`, the motion in `base_link`.

    All covariances are 0, which means unknown.
    """
    twist = ros(
        "geometry_msgs/Twist",
        linear=vector(state.speed_mps, state.lateral_speed_mps),
        angular=vector(0.0, 0.0, state.yaw_rate_radps),
    )
    unknown = np.zeros(36)
    return ros(
        "nav_msgs/Odometry",
        header=header(state.t_ns, f"{name}/odom"),
        child_frame_id=f"{name}/base_link",
        pose=ros("geometry_msgs/PoseWithCovariance", pose=pose(at), covariance=unknown),
        twist=ros("geometry_msgs/TwistWithCovariance", twist=twist, covariance=unknown),
    )


def occupancy_grid(name: str, room: OccupancyMap) -> Any:
    """Return `nav_msgs/OccupancyGrid`: the map that a car makes, in its frame `<name>/map`."""
    cells = np.frombuffer(room.cells, np.int8).reshape(room.rows, room.columns)
    corner = Pose2(room.x_m, room.y_m, 0.0)
    return _grid(header(room.t_ns, f"{name}/map"), cells, room.cell_m, corner)


def _grid(stamp: Any, cells: NDArray[np.int8], cell_m: float, corner: Pose2) -> Any:
    info = ros(
        "nav_msgs/MapMetaData",
        map_load_time=stamp.stamp,
        resolution=cell_m,
        width=cells.shape[1],
        height=cells.shape[0],
        origin=pose(corner),
    )
    return ros("nav_msgs/OccupancyGrid", header=stamp, info=info, data=cells.ravel())


def city_grid(city_map: CityMap, t_ns: int) -> Any:
    """Return `nav_msgs/OccupancyGrid`: walls and mapped boxes of a city, free floor else.

    Cells are `MAP_CELL_M` wide, wider where there would be more than `MAP_CELLS`. A cell is
    occupied where a face of a wall or box comes within half a cell of its middle.
    """
    (left, right), (low, high) = city_map.floor.x_m, city_map.floor.y_m
    cell = max(MAP_CELL_M, math.sqrt((right - left) * (high - low) / MAP_CELLS))
    rows, columns = math.ceil((high - low) / cell), math.ceil((right - left) / cell)
    cells = np.zeros((rows, columns), np.int8)
    mapped = replace(city_map, boxes=tuple(box for box in city_map.boxes if box.mapped))
    for x0, y0, x1, y1 in wall_segments(mapped):
        count = math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0) / cell) + 1
        part = np.linspace(0.0, 1.0, count)
        column = np.floor((x0 + part * (x1 - x0) - left) / cell).astype(int)
        row = np.floor((y0 + part * (y1 - y0) - low) / cell).astype(int)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        cells[row[inside], column[inside]] = OCCUPIED
    return _grid(header(t_ns, "map"), cells, cell, Pose2(left, low, 0.0))


def place_of(goal: Any) -> str:
    """Return a `geometry_msgs/PoseStamped` as a goal: `X,Y,DEG` of the city's map.

    Raises:
        MessageError: when it is in another frame than `map`, or no number.
    """
    frame, at, turn = goal.header.frame_id, goal.pose.position, goal.pose.orientation
    if frame not in ("", "map"):
        raise MessageError(f"goal_pose: expected the frame map, got {frame!r}")
    yaw = math.atan2(2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y**2 + turn.z**2))
    if not all(map(math.isfinite, (at.x, at.y, yaw))):
        raise MessageError(f"goal_pose: expected numbers, got {at.x}, {at.y}, {yaw}")
    return f"{at.x:.4f},{at.y:.4f},{math.degrees(yaw):.3f}"


def scan(name: str, turn: LidarScan, before_ns: int | None) -> Any:
    """Return `sensor_msgs/LaserScan`: infinity means no echo (REP-117).

    The stamp is the time of the first ray; ray i is `i * time_increment` later.
    A clockwise sweep is listed from its left end, with a negative `angle_increment`.

    Args:
        name: The car's in ROS.
        turn: The scan.
        before_ns: Time of the previous scan, for scans without a period; None: not known.
    """
    step = turn.bearing_step_rad if turn.bearing_step_rad is not None else TAU / max(1, turn.beams)
    ranges = np.frombuffer(turn.payload, "<f4", count=len(turn.payload) // SCAN_BYTES)
    ends = turn.bearing_first_rad, turn.bearing_first_rad + step * (turn.beams - 1)
    if turn.clockwise:
        ranges, ends, step = ranges[::-1], ends[::-1], -step
    period_ns = turn.period_ns
    if period_ns is None:
        period_ns = 0 if before_ns is None else max(0, turn.t_ns - before_ns)
    return ros(
        "sensor_msgs/LaserScan",
        header=header(turn.t_ns - round((turn.beams - 1) * turn.beam_ns), f"{name}/laser"),
        angle_min=ends[0],
        angle_max=ends[1],
        angle_increment=step,
        time_increment=turn.beam_ns / NS_PER_S,
        scan_time=seconds(period_ns),
        range_min=turn.range_min_m,
        range_max=turn.range_max_m,
        ranges=ranges.astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )


def imu(name: str, sensors: VehicleSensors) -> Any:
    """Return `sensor_msgs/Imu`; the covariance of what is not measured begins with -1."""
    unknown = np.zeros(9)
    turn = sensors.orientation_rad
    nothing = unknown.copy()
    nothing[0] = _NOT_MEASURED
    return ros(
        "sensor_msgs/Imu",
        header=header(sensors.t_ns, f"{name}/imu"),
        orientation=quaternion(turn if turn is not None else (0.0, 0.0, 0.0)),
        orientation_covariance=unknown if turn is not None else nothing,
        angular_velocity=vector(*sensors.gyro_radps),
        angular_velocity_covariance=unknown,
        linear_acceleration=vector(*sensors.accel_mps2),
        linear_acceleration_covariance=unknown,
    )


def picture(name: str, frame: CameraFrame) -> Any:
    """Return `sensor_msgs/CompressedImage` with the JPEG file as received."""
    return ros(
        "sensor_msgs/CompressedImage",
        header=header(frame.t_ns, f"{name}/camera_optical"),
        format="jpeg",
        data=np.frombuffer(frame.payload, np.uint8),
    )


def speed_and_angle(kind: str, message: Any, wheelbase_m: float) -> tuple[float, float]:
    """Return speed [m/s] and road-wheel angle [rad, + = left] that a command requests.

    A car cannot turn on the spot: a yaw rate at standstill is ignored. NaN and infinity mean
    standstill.
    """
    if kind == "geometry_msgs/Twist":
        speed, rate = message.linear.x, message.angular.z
        # The angle for v and omega, also in reverse, where both change their sign.
        angle = math.atan(wheelbase_m * rate / speed) if speed else 0.0
    else:
        speed, angle = message.speed, message.steering_angle
    if not (math.isfinite(speed) and math.isfinite(angle)):
        return 0.0, 0.0
    return float(speed), float(angle)
