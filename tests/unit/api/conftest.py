"""A view that received a little, a city that answers from a list, and a client without sockets."""

import asyncio
import inspect
import json
import threading
from dataclasses import replace

import httpx
import pytest
from fastapi import routing
from fastapi.dependencies import models

from scm.api import openapi
from scm.api.acknowledgements import Acknowledgements
from scm.api.app import create_app
from scm.api.keys import KeyRing
from scm.api.view import CityView
from scm.clock import NS_PER_S, StepClock
from scm.maps.load import load_map
from scm.records.signals import SignalGroup
from scm.store.memory import MemoryStore
from scm.v2x.exchange import Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

HERE = "http://127.0.0.1:8000"


class FakeCity:
    """Answers by the class of the request, and remembers the requests."""

    def __init__(self):
        self.asked = []
        self.answers = {}
        self._news = threading.Condition()

    def wait_for(self, count):
        """Wait for so many requests: a server may send one after its client has gone."""
        with self._news:
            assert self._news.wait_for(lambda: len(self.asked) >= count, 20.0)

    def ask(self, request, timeout_s):
        assert timeout_s > 0.0
        with self._news:
            self.asked.append(request)
            self._news.notify_all()
        return self.answers.get(type(request), Refused(code="offline", detail="nobody answers"))


class Client:
    """Calls an application directly; every call runs its own event loop."""

    def __init__(self, app, base_url=HERE):
        self.app = app
        self.base_url = base_url

    def __call__(self, method, path, **options):
        async def call():
            transport = httpx.ASGITransport(self.app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url=self.base_url) as client:
                return await client.request(method, path, **options)

        return asyncio.run(call())


class SameCode(models._CallIdentity):
    """Tells FastAPI's functions apart by their code: closures of two applications are alike."""

    __slots__ = ("code",)

    def __init__(self, call):
        super().__init__(call)
        self.code = [getattr(each, "__code__", each) for each in (call, inspect.unwrap(call))]

    def __hash__(self):
        return hash(self.code[-1])

    def __eq__(self, other):
        return isinstance(other, SameCode) and self.code == other.code


@pytest.fixture(scope="package", autouse=True)
def routes_read_once():
    """Let FastAPI read each route once: hundreds of applications here have the same routes.

    What it remembers of functions would otherwise keep dozens of applications in memory.
    """
    read, describe = routing.get_dependant, openapi.get_openapi
    read_required = routing.get_parameterless_sub_dependant
    read_returned = routing.get_typed_return_annotation
    found, required, returned, documents = {}, {}, {}, {}

    def get_dependant(*, path, call, scope):
        key = (path, SameCode(call))
        if key not in found:
            found[key] = read(path=path, call=call, scope=scope)
        same = found[key]
        return replace(same, call=call, dependencies=list(same.dependencies))

    def get_required(*, depends, path):
        key = (path, id(depends))
        if key not in required:
            required[key] = read_required(depends=depends, path=path), depends  # keeps its id
        return required[key][0]

    def get_returned(call):
        key = SameCode(call)
        if key not in returned:
            returned[key] = read_returned(call)
        return returned[key]

    def get_openapi(*, routes, servers, **words):
        key = repr((servers, len(routes)))
        if key not in documents:
            documents[key] = json.dumps(describe(routes=routes, servers=servers, **words))
        return json.loads(documents[key])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(models, "_CallIdentity", SameCode)
        patch.setattr(routing, "get_dependant", get_dependant)
        patch.setattr(routing, "get_parameterless_sub_dependant", get_required)
        patch.setattr(routing, "get_typed_return_annotation", get_returned)
        patch.setattr(openapi, "get_openapi", get_openapi)
        yield


@pytest.fixture(scope="session")
def city_map():
    return load_map("driving_school")


@pytest.fixture
def view():
    return CityView()


@pytest.fixture
def hear(view):
    """Step the view at a time [s] with messages that arrive then."""

    def step(at_s, *messages):
        now_ns = round(at_s * NS_PER_S)
        return view.step(now_ns, [Incoming(message, now_ns) for message in messages])

    return step


@pytest.fixture
def fake_city():
    return FakeCity()


@pytest.fixture
def seen():
    """Acknowledgements that nobody has made yet."""
    return Acknowledgements(MemoryStore(), StepClock())


@pytest.fixture
def app(view, fake_city, city_map):
    return create_app(view, fake_city.ask, city_map, plans={"crossing": ("calm", "busy")})


@pytest.fixture
def client(app):
    return Client(app)


@pytest.fixture
def client_of():
    return Client


@pytest.fixture
def snapshot():
    """Build a snapshot at a time [s] of cars given as keyword: name=(x_m, y_m, yaw_rad)."""

    def build(at_s=1.0, tick=1, alive=True, **cars):
        vehicles = tuple(
            SnapshotVehicle(
                vehicle=name,
                kind="hosted",
                car="nigel",
                tag_id=number + 1,
                x_m=pose[0],
                y_m=pose[1],
                yaw_rad=pose[2],
                speed_mps=0.2,
                steering_rad=0.1,
                alive=alive,
            )
            for number, (name, pose) in enumerate(cars.items())
        )
        return WorldSnapshot(t_ns=round(at_s * NS_PER_S), tick=tick, vehicles=vehicles)

    return build


@pytest.fixture
def spat():
    """Build the crossing's SPaT at a time [s] on the controller's clock: green for 4 to 6 s."""

    def build(at_s=100.0, colour="green", plan="calm", mode="plan"):
        t_ns = round(at_s * NS_PER_S)
        group = SignalGroup(
            group="south_east",
            colour=colour,
            since_ns=t_ns,
            min_end_ns=t_ns + 4 * NS_PER_S,
            max_end_ns=t_ns + 6 * NS_PER_S,
            next_colour="yellow",
        )
        return Spat(junction="crossing", t_ns=t_ns, seq=1, mode=mode, plan=plan, groups=(group,))

    return build


@pytest.fixture
def event():
    def build(text, severity="info"):
        return CityEvent(severity=severity, source="world", t_ns=1, name="told", text=text)

    return build


@pytest.fixture
def ring():
    return KeyRing(MemoryStore())


@pytest.fixture
def key_of(ring):
    """Make a key of a role."""
    return lambda role: ring.add("anna", role, 1)


@pytest.fixture
def keyed_app(view, fake_city, city_map, ring):
    fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
    return create_app(view, fake_city.ask, city_map, keys=ring)


def bearer(key):
    """Return the header that carries a key."""
    return {"Authorization": f"Bearer {key}"}
