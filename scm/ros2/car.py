"""One car in ROS: its topics while it is in the city, and the subscriptions that they need.

    <car>/odom              nav_msgs/Odometry            20 Hz       by dead reckoning
    <car>/scan              sensor_msgs/LaserScan        as scanned
    <car>/imu               sensor_msgs/Imu              as measured, 50 Hz
    <car>/camera/compressed sensor_msgs/CompressedImage  15 Hz       front camera
    <car>/map               nav_msgs/OccupancyGrid       1 Hz        while the car maps a room
    <car>/goal_pose         geometry_msgs/PoseStamped    subscribed, for a car that parks itself
    <car>/cmd_vel           geometry_msgs/Twist          subscribed
    <car>/ackermann_cmd     ackermann_msgs/AckermannDrive  subscribed

The city makes scans, measurements and pictures only for subscribers: the car subscribes to those
that some ROS node subscribes to.
"""

from collections.abc import Callable
from typing import Any

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.ros2 import convert, frames
from scm.ros2.pilot import Pilot
from scm.ros2.wire import Endpoint, Graph, Topic
from scm.runtime.part import Subscription
from scm.v2x.exchange import Call, Outgoing
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.park_request import ParkRequest
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import Car
from scm.vehicles.drivers.limits import limits_of

ODOM_NS = 50 * NS_PER_MS
FRONT = "front"
GOAL, GOAL_TYPE = "goal_pose", "geometry_msgs/PoseStamped"
PARK_TIMEOUT_S = 2.0
COMMANDS = {"cmd_vel": "geometry_msgs/Twist", "ackermann_cmd": "ackermann_msgs/AckermannDrive"}
_SHOWN = {
    "odom": "nav_msgs/Odometry",
    "scan": "sensor_msgs/LaserScan",
    "imu": "sensor_msgs/Imu",
    "camera/compressed": "sensor_msgs/CompressedImage",
    "map": "nav_msgs/OccupancyGrid",
}


class RosCar:
    """A car that ROS nodes see and may drive.

    Args:
        vehicle: Its name in the city; `name` its name in ROS.
        car: Its car file.
        graph: Where its topics go.
        owner: Holder of the lease when a node drives it.
    """

    def __init__(self, vehicle: str, name: str, car: Car, graph: Graph, owner: str) -> None:
        self.vehicle = vehicle
        self.name = name
        self.car = car
        self._pilot = Pilot(vehicle, owner, limits_of(car))
        self._reckoning = frames.DeadReckoning()
        self._topics: dict[str, Topic] = {
            topic: graph.publisher(f"/{name}/{topic}", kind) for topic, kind in _SHOWN.items()
        }
        self._ears: list[Endpoint] = [
            graph.subscribe(f"/{name}/{topic}", kind)
            for topic, kind in (*COMMANDS.items(), (GOAL, GOAL_TYPE))
        ]
        self._goal: Call | None = None
        self._speed_mps = 0.0
        self._odom_ns = 0
        self._scan_ns: int | None = None
        self._show: dict[type[Message], Callable[[Any, int], list[Any]]] = {
            VehicleState: self._show_state,
            LidarScan: self._show_scan,
            VehicleSensors: self._show_sensors,
            CameraFrame: self._show_picture,
            OccupancyMap: self._show_map,
        }

    def subscriptions(self, *, moves: bool) -> list[Subscription]:
        """Return the subscriptions needed for the present subscribers of its topics.

        Args:
            moves: Whether `/tf` has subscribers, who need its motion.
        """
        wanted = {topic for topic, publisher in self._topics.items() if publisher.is_wanted}
        own = {"vehicle": self.vehicle}
        out = []
        if moves or "odom" in wanted or self._pilot.is_driving:
            out.append(Subscription(VehicleState, own))
        if "scan" in wanted:
            out.append(Subscription(LidarScan, own))
        if "map" in wanted:
            out.append(Subscription(OccupancyMap, own))
        if "imu" in wanted:
            out.append(Subscription(VehicleSensors, own))
        if "camera/compressed" in wanted:
            out.append(Subscription(CameraFrame, own | {"camera": FRONT}))
        return out

    def show(self, message: Message, now_ns: int) -> list[Any]:
        """Publish a message about the car to ROS; return transforms for `/tf`."""
        return self._show[type(message)](message, now_ns)

    def _show_state(self, state: VehicleState, now_ns: int) -> list[Any]:
        self._speed_mps = state.speed_mps
        at = self._reckoning.step(state)
        late_ns = state.t_ns - self._odom_ns
        if -ODOM_NS <= late_ns < 0:
            return []
        # Every second or third of the 50 states a second: 20 Hz on average.
        self._odom_ns = (self._odom_ns if 0 <= late_ns < ODOM_NS else state.t_ns) + ODOM_NS
        self._topics["odom"].publish(convert.odometry(self.name, state, at), now_ns)
        odom = f"{self.name}/odom"
        map_T_odom = Pose2(state.x_m, state.y_m, state.yaw_rad) @ at.inverse()  # noqa: N806
        return [
            frames.moving(state.t_ns, frames.MAP, odom, map_T_odom),
            frames.moving(state.t_ns, odom, f"{self.name}/base_link", at),
        ]

    def _show_scan(self, scan: LidarScan, now_ns: int) -> list[Any]:
        self._topics["scan"].publish(convert.scan(self.name, scan, self._scan_ns), now_ns)
        self._scan_ns = scan.t_ns
        return []

    def _show_sensors(self, sensors: VehicleSensors, now_ns: int) -> list[Any]:
        self._topics["imu"].publish(convert.imu(self.name, sensors), now_ns)
        return []

    def _show_picture(self, frame: CameraFrame, now_ns: int) -> list[Any]:
        self._topics["camera/compressed"].publish(convert.picture(self.name, frame), now_ns)
        return []

    def _show_map(self, room: OccupancyMap, now_ns: int) -> list[Any]:
        self._topics["map"].publish(convert.occupancy_grid(self.name, room), now_ns)
        return []

    def command(self, topic: str, message: Any, now_ns: int) -> None:
        """Accept the command of a ROS node on one of the topics `COMMANDS`, or a goal."""
        if topic == GOAL:
            goal = convert.place_of(message)
            self._goal = Call(ParkRequest(vehicle=self.vehicle, goal=goal), PARK_TIMEOUT_S)
            return
        wheelbase = self._pilot.limits.wheelbase
        speed, angle = convert.speed_and_angle(COMMANDS[topic], message, wheelbase)
        self._pilot.set_command(speed, angle, now_ns)

    @property
    def pilot(self) -> Pilot:
        """The pilot that drives it for ROS."""
        return self._pilot

    def drive(self, now_ns: int) -> list[Outgoing]:
        """Return the messages that its pilot sends now, and a goal that came for it."""
        goal, self._goal = self._goal, None
        out = self._pilot.step(now_ns, self._speed_mps)
        return out if goal is None else [*out, goal]

    def close(self) -> None:
        """Remove its topics from the ROS graph."""
        for end in (*self._topics.values(), *self._ears):
            end.close()
