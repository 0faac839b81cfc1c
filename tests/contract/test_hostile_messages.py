"""Whatever reads as a message, no part of the city stops at its numbers.

Every class is sent with the ends of what its fields can hold, into a city whose parts all run.
"""

from functools import cache

import msgspec
import pytest
from msgspec import inspect

from scm.api.encoding import encode as to_json
from scm.api.eye_rows import camera_rows
from scm.api.signal_rows import junction_rows
from scm.api.vehicle_rows import vehicles_topic
from scm.api.view import CityView
from scm.errors import MessageError
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.traffic.demand.part import DemandPart
from scm.traffic.demand.table import Flow
from scm.traffic.misbehaviour.part import MisbehaviourPart
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.observation.part import ObserverPart
from scm.traffic.signals.part import TrafficPart
from scm.v2x.exchange import Call
from scm.v2x.key import key_of
from scm.v2x.message import Request, decode, encode
from scm.v2x.messages import message_classes
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart

PACKAGE = "scm.v2x.messages"
MAP = load_map("driving_school")
INTEGERS = (0, -1, 1, 2**63 - 1, -(2**63))
FLOATS = (0.0, -0.0, 1e-320, 1e154, 1.7e308, -1.7e308, 0.3)
# so that a message concerns somebody who is there
PLACES = {
    "vehicle": ("n1", "n2", "n R"),
    "receiver": ("n2",),
    "station": ("n1", "n2", "world"),
    "suspect": ("n1", "n2"),
    "source": ("world",),
    "junction": ("crossing",),
    "camera": ("overhead",),
    "owner": ("ann", "n2", "world"),
    "car": ("nigel",),
    "kind": ("remote",),
    "neighbour": ("east",),
}
BITS = ("0" * 16, "1" * 16, "01" * 8)  # of the one field that has a pattern: status bits
MADE_BY_THE_BUS_OR_ONCE = {"presence", "world_definition"}


SENT = [
    kind
    for kind in message_classes()
    if kind.__module__.rpartition(".")[2] not in MADE_BY_THE_BUS_OR_ONCE
]


def extreme(of, name, turn):
    """Return the `turn`-th value for a field, through all its ends and in another order each."""
    of = of.type if isinstance(of, inspect.Metadata) else of
    if name in PLACES and isinstance(of, inspect.StrType):
        return PLACES[name][turn % len(PLACES[name])]
    return MAKERS[type(of)](of, turn)


def integer(of, turn):
    value = INTEGERS[turn % len(INTEGERS)]
    value = value if of.ge is None else max(of.ge, value)
    return value if of.le is None else min(of.le, value)


def words(of, turn):
    if of.pattern is not None:
        return BITS[turn % len(BITS)]
    text = ("", "x" * 3000, "\u0000")[turn % 3].ljust(of.min_length or 0, "x")
    return text if of.max_length is None else text[: of.max_length]


MAKERS = {
    inspect.IntType: integer,
    inspect.FloatType: lambda _, turn: FLOATS[turn % len(FLOATS)],
    inspect.BoolType: lambda _, turn: turn % 2 == 0,
    inspect.StrType: words,
    inspect.BytesType: lambda *_: b"\xff",
    inspect.NoneType: lambda *_: None,
    inspect.LiteralType: lambda of, turn: of.values[turn % len(of.values)],
    inspect.UnionType: lambda of, turn: extreme(of.types[turn % len(of.types)], "", turn),
    inspect.StructType: lambda of, turn: fields(of.cls, turn),
    inspect.VarTupleType: lambda of, turn: [
        extreme(of.item_type, "", turn + i) for i in range(max(turn % 3, of.min_length or 0))
    ],
    inspect.TupleType: lambda of, turn: [
        extreme(item, "", turn + i) for i, item in enumerate(of.item_types)
    ],
}


def fields(kind, turn):
    shape = shape_of(kind)
    return {f.name: extreme(f.type, f.name, turn + i * 3) for i, f in enumerate(shape.fields)}


@cache
def shape_of(kind):
    return inspect.type_info(kind)


@pytest.fixture(scope="module")
def city():
    view = CityView()
    parts = [
        WorldPart(MAP, 0, (("n1", "nigel"),)),
        TrafficPart(MAP, policy="actuated"),
        MonitorPart(MAP),
        ObserverPart(MAP),
        MisbehaviourPart(MAP),
        DemandPart(MAP, (Flow("east_loop", "west_loop", 600.0),), 0.0),
        view,
    ]
    with Lockstep([*parts, AgentPart("n2")], start_ns=10**18) as running:
        running.run_for(1.5)
        yield running, view


@pytest.mark.parametrize("kind", SENT, ids=lambda kind: kind.__name__)
def test_no_part_stops_at_extreme_numbers(city, kind):
    running, view = city
    sent = 0
    for turn in range(35):
        try:
            message = msgspec.convert(fields(kind, turn), kind)
            key_of("city", message)
            decode(kind, *encode(message))
        except (msgspec.ValidationError, MessageError):
            continue
        sent += 1
        if issubclass(kind, Request):
            running.bus.call(Call(message, 1.0), lambda _reply: None)
        else:
            running.publish(message)
        running.run_for(0.02)
        picture = view.picture()
        rows = (
            vehicles_topic(picture),
            junction_rows(picture, MAP.junctions, {}),
            camera_rows(picture),
        )
        assert all(map(to_json, rows))
    running.run_for(0.1)  # so that the slowest part has seen all of them
    assert sent > 5
