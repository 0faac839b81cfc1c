"""A ROS graph that only notes what is published, and a small city beside it on a stepped clock."""

import pytest

from scm.maps.load import load_map
from scm.ros2.part import RosPart
from scm.ros2.wire import Received
from scm.runtime.lockstep import Lockstep
from scm.world.part import WorldPart


class NotedTopic:
    def __init__(self, graph, topic, kind, latched):
        self.graph, self.topic, self.kind, self.latched = graph, topic, kind, latched
        self.sent = []
        self.closed = False

    @property
    def is_wanted(self):
        return self.topic in self.graph.wanted

    def publish(self, message, t_ns):
        self.sent.append((message, t_ns))

    def close(self):
        self.closed = True


class NotedGraph:
    """Stands in for the wire: `wanted` are the topics somebody subscribes to."""

    def __init__(self):
        self.wanted = set()
        self.topics = {}
        self.ears = {}
        self._received = []

    def publisher(self, topic, kind, *, latched=False):
        self.topics[topic] = NotedTopic(self, topic, kind, latched)
        return self.topics[topic]

    def subscribe(self, topic, kind):
        self.ears[topic] = NotedTopic(self, topic, kind, latched=False)
        return self.ears[topic]

    def received(self):
        out, self._received = self._received, []
        return out

    def say(self, topic, message):
        self._received.append(Received(topic, message))

    def sent(self, topic):
        return [message for message, _ in self.topics[topic].sent]


class RosCity:
    """A world with cars, the ROS part, and the lockstep they run in."""

    def __init__(self, cars=2, more=()):
        self.graph = NotedGraph()
        city_map = load_map("driving_school")
        self.hosted = tuple((f"n{i + 1}", "nigel") for i in range(cars))
        self.world = WorldPart(city_map, hosted=self.hosted)
        self.ros = RosPart(city_map, self.graph)
        self.lockstep = Lockstep([self.world, self.ros, *more])


@pytest.fixture
def graph():
    return NotedGraph()


@pytest.fixture
def city():
    made = RosCity()
    with made.lockstep:
        made.lockstep.run_for(0.3)
        yield made
