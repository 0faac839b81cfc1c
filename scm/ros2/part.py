"""The part that publishes the city to ROS 2 nodes and lets them drive its cars.

    /clock          rosgraph_msgs/Clock              20 Hz      the world's time
    /tf             tf2_msgs/TFMessage               20 Hz      map -> odom -> base_link of each car
    /tf_static      tf2_msgs/TFMessage               latched    where sensors sit on the cars
    /city/markers   visualization_msgs/MarkerArray   10 Hz      cars, boxes, lit lamps
    /city/roads     visualization_msgs/MarkerArray   latched    lanes and walls

and the topics of each car in `car.py`. On the city's bus it is a part like any other; the ROS side
is the given `Graph`. It subscribes only to what ROS nodes subscribe to.
"""

import logging
from collections.abc import Sequence
from typing import Any

from scm.clock import NS_PER_MS
from scm.errors import CarError, MessageError
from scm.log import event
from scm.records.city_map import CityMap
from scm.ros2 import convert, frames, markers
from scm.ros2.car import RosCar
from scm.ros2.names import ros_name
from scm.ros2.types import ros
from scm.ros2.wire import Graph
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.message import Message, Refused
from scm.v2x.messages.lease_request import LeaseRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.vehicles.car import Car, load_car

CHECK_NS = 200 * NS_PER_MS
MARKERS_EVERY = 2  # snapshots
_ALWAYS = (Subscription(WorldSnapshot),)
_TF = "tf2_msgs/TFMessage"
_MARKERS = "visualization_msgs/MarkerArray"

_log = logging.getLogger(__name__)


class RosPart(BasePart):
    """The bridge; the caller closes `graph`."""

    name = "ros2"
    role = "part"
    period_ns = 10 * NS_PER_MS

    def __init__(self, city_map: CityMap, graph: Graph) -> None:
        self.subscriptions: Sequence[Subscription] = _ALWAYS
        self._map = city_map
        self._graph = graph
        self._clock = graph.publisher("/clock", "rosgraph_msgs/Clock")
        self._tf = graph.publisher("/tf", _TF)
        self._mounts = graph.publisher("/tf_static", _TF, latched=True)
        self._markers = graph.publisher("/city/markers", _MARKERS)
        self._roads = graph.publisher("/city/roads", _MARKERS, latched=True)
        self._city_grid = graph.publisher("/map", "nav_msgs/OccupancyGrid", latched=True)
        self._cars: dict[str, RosCar] = {}
        self._unknown: set[str] = set()
        self._spats: dict[str, Spat] = {}
        self._check_ns: int | None = None
        self._snapshots = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Publish the city's messages to ROS; send the commands of ROS nodes to their cars."""
        moved: list[Any] = []
        for item in inbox:
            moved += self._process(item, now_ns)
        if moved:
            self._tf.publish(ros(_TF, transforms=moved), now_ns)
        for topic, message in self._graph.received():
            name, _, command = topic.strip("/").partition("/")
            for car in self._cars.values():
                if car.name == name:
                    self._command(car, command, message, now_ns)
        if self._check_ns is None:
            self._roads.publish(markers.roads(self._map, now_ns), now_ns)
            self._city_grid.publish(convert.city_grid(self._map, now_ns), now_ns)
        if self._check_ns is None or now_ns >= self._check_ns:
            self._check_ns = now_ns + CHECK_NS
            self._update_subscriptions()
        return [item for car in self._cars.values() for item in car.drive(now_ns)]

    def _command(self, car: RosCar, topic: str, message: Any, now_ns: int) -> None:
        try:
            car.command(topic, message, now_ns)
        except MessageError as cause:
            event(_log, "ros_refused", level=logging.WARNING, vehicle=car.vehicle, why=str(cause))

    def _process(self, item: Incoming, now_ns: int) -> list[Any]:
        """Publish one thing; return transforms."""
        message = item.message
        if item.call is not None:
            request = item.call.request
            if isinstance(request, LeaseRequest) and request.vehicle in self._cars:
                self._cars[request.vehicle].pilot.replied(request, message)
            elif isinstance(message, Refused):
                event(_log, "ros_refused", level=logging.WARNING, why=message.detail)
        elif isinstance(message, WorldSnapshot):
            self._process_snapshot(message, now_ns)
        elif isinstance(message, Spat):
            self._spats[message.junction] = message
        else:
            car = self._cars.get(str(getattr(message, "vehicle", "")))
            return [] if car is None else self._show(car, message, now_ns)
        return []

    def _show(self, car: RosCar, message: Message, now_ns: int) -> list[Any]:
        try:
            return car.show(message, now_ns)
        except MessageError as cause:
            event(_log, "ros_refused", level=logging.WARNING, vehicle=car.vehicle, why=str(cause))
            return []

    def _process_snapshot(self, snapshot: WorldSnapshot, now_ns: int) -> None:
        self._clock.publish(convert.clock(snapshot.t_ns), now_ns)
        self._update_cars({row.vehicle: row.car for row in snapshot.vehicles}, now_ns)
        self._snapshots += 1
        if self._snapshots % MARKERS_EVERY == 0 and self._markers.is_wanted:
            cars = {car.car.name: car.car for car in self._cars.values()}
            self._markers.publish(markers.moving(self._map, snapshot, self._spats, cars), now_ns)

    def _update_cars(self, here: dict[str, str], now_ns: int) -> None:
        """Follow who came and who left."""
        gone = [vehicle for vehicle in self._cars if vehicle not in here]
        come = [vehicle for vehicle in here if vehicle not in self._cars.keys() | self._unknown]
        self._unknown &= here.keys()
        for vehicle in gone:
            self._cars.pop(vehicle).close()
        for vehicle in come:
            self._add_car(vehicle, here[vehicle])
        if gone or come:
            mounts = [
                m for car in self._cars.values() for m in frames.mounts(car.name, car.car, now_ns)
            ]
            self._mounts.publish(ros(_TF, transforms=mounts), now_ns)

    def _add_car(self, vehicle: str, kind: str) -> None:
        name = ros_name(vehicle)
        if any(car.name == name for car in self._cars.values()):
            self._refuse(vehicle, f"another car is called {name} in ROS")
            return
        try:
            car: Car = load_car(kind)
        except CarError as cause:
            self._refuse(vehicle, str(cause))
            return
        self._cars[vehicle] = RosCar(vehicle, name, car, self._graph, self.name)

    def _refuse(self, vehicle: str, why: str) -> None:
        self._unknown.add(vehicle)
        event(_log, "ros_car_not_shown", level=logging.WARNING, vehicle=vehicle, why=why)

    def _update_subscriptions(self) -> None:
        """Receive what is subscribed now; an equal list stays the same object."""
        moves = self._tf.is_wanted
        wanted = [
            *_ALWAYS,
            *(h for car in self._cars.values() for h in car.subscriptions(moves=moves)),
        ]
        if self._markers.is_wanted:
            wanted.append(Subscription(Spat))
        if wanted != list(self.subscriptions):
            self.subscriptions = wanted

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the leases and remove the cars from the ROS graph."""
        del now_ns
        out = [item for car in self._cars.values() for item in car.pilot.release()]
        for car in self._cars.values():
            car.close()
        return out
