"""What crosses between two cities, over real routers: what was chosen, and nothing else.

City a shows b its states and SPATEM. An intruder of city b tries everything else: as the station of
b with the most rights, and as a router of b that keeps to no rules. The control comes first: what
was chosen arrives.
"""

import pytest
import zenoh

from scm.records.city_map import NEIGHBOUR_MESSAGES
from scm.v2x.crossing import BORDER, GATEWAY, HANDOVER, SHOWN, gateway_station, shown_keys
from scm.v2x.key import matches, prefix, variables
from scm.v2x.message import Request
from scm.v2x.messages import message_classes
from scm.v2x.rights import _OF_PART, ROLES, rights_of
from tests.unit.v2x.two_cities import NEVER, TwoCities, until

A, B = prefix("a"), prefix("b")
CHOSEN = ("states", "cams", "spatem")
CHOSEN_KEYS = ("v/*/state", "v2x/tx/*/cam", "v2x/tx/*/spatem", "neighbour/b")
STATE = "v/n1/state"

pytestmark = pytest.mark.usefixtures("lasting_links")


def example(key):
    """Return a key that a pattern of the table of rights stands for."""
    return key.replace("{me}", "n1").replace("**", "any/thing").replace("*", "x1")


def message_keys(of):
    """Return a key of each class of messages for which `of` is true."""
    return {
        kind.KEY.format(**dict.fromkeys(variables(kind), "x1"))
        for kind in message_classes()
        if of(kind)
    }


def is_request(kind):
    return issubclass(kind, Request)


def all_rights():
    parts = (rights_of("part", name) for name in _OF_PART)
    return [*parts, *(rights_of(role, "n1") for role in ROLES if role != "part")]


MESSAGES = message_keys(lambda kind: not is_request(kind)) | {
    example(key) for one in all_rights() for key in (*one.publishes, *one.subscribes)
}
REQUESTS = message_keys(is_request) | {
    example(key) for one in all_rights() for key in (*one.requests, *one.services)
}
WIDE = (
    "**",
    "v/*/state",
    "v/*/**",
    "*/*/state",
    "world/*",
    "@adv/**",
    "v/*/@camera/*",
    "part/*/alive/*",
)


@pytest.fixture(scope="module", params=["open", "mtls"])
def cities(request, tmp_path_factory):
    cities = TwoCities(tmp_path_factory.mktemp("ab"), request.param, {"a": CHOSEN, "b": CHOSEN})
    with cities.stack:
        yield cities


@pytest.fixture(scope="module", params=["station", "rogue gateway"])
def intruder(request, cities):
    """Return a session of city b that has seen a state of city a."""
    if "a" not in cities.routers:
        cities.start("a")
    if request.param == "station":
        if "b" not in cities.routers:
            cities.start("b")
        session = cities.raw("b", "world")
    else:
        session = cities.rogue_gateway()
    return session


@pytest.fixture(scope="module")
def honest(cities, intruder):
    """Return a session of city a that watches and publishes everything of it."""
    return cities.raw("a", "selftest")


class Seen:
    """What a session receives on some keys."""

    def __init__(self, session, *keys):
        self.samples = []
        take = zenoh.handlers.Callback(
            lambda sample: self.samples.append((str(sample.key_expr), bytes(sample.payload))),
            indirect=False,
        )
        self._declared = [session.declare_subscriber(key, take) for key in keys]

    def has(self, key):
        return any(seen == key for seen, _ in list(self.samples))

    def close(self):
        for one in self._declared:
            one.undeclare()


def test_intruder_sees_what_was_chosen_and_nothing_else(honest, intruder):
    wide = [A + key for key in (*WIDE, *MESSAGES, *REQUESTS)]
    seen = Seen(intruder, *wide, "scm/@v1/**")
    fence = A + "v/fence/state"
    until(lambda: seen.has(A + STATE), also=lambda: honest.put(A + STATE, b"control"))
    for key in MESSAGES | REQUESTS:
        honest.put(A + key, b"secret")
    until(lambda: seen.has(fence), also=lambda: honest.put(fence, b"control"))
    allowed = [A + key for key in CHOSEN_KEYS]
    received = {key for key, _ in seen.samples}
    assert {key for key in received if not any(matches(one, key) for one in allowed)} == set()
    assert A + "v2x/tx/x1/spatem" in received
    seen.close()


def test_city_receives_nothing_that_an_intruder_publishes_in_its_name(cities, honest, intruder):
    # Of a broad subscription the other side learns nothing: it might send what it knows is read.
    own = {A + key for key in ("**", BORDER + "*", "v/*/cmd/*", *MESSAGES, *REQUESTS)}
    watching = Seen(honest, *own, B + "v/*/state")
    near = A + BORDER + "b"  # cars of b near the border, for the world of a
    until(lambda: watching.has(near), also=lambda: intruder.put(near, b"control"))
    fence = B + "v/fence/state"  # what b may say of itself
    until(lambda: watching.has(fence), also=lambda: intruder.put(fence, b"control"))
    as_others = {BORDER + name for name in ("a", "c", "*")}
    for key in MESSAGES | REQUESTS | as_others | {"**", "v/**", "v/*/state", "v/n1/cmd/drive"}:
        intruder.put(A + key, b"forged")
        intruder.delete(A + key)
    watching.samples.clear()
    until(lambda: watching.has(fence), also=lambda: intruder.put(fence, b"control"))
    assert [sample for sample in watching.samples if sample[0].startswith(A)] == []
    watching.close()


def test_city_sees_of_its_neighbour_only_what_can_be_chosen(honest, intruder):
    watching = Seen(honest, B + "v/*/state", B + "**")
    fence = B + "v/fence/state"
    until(lambda: watching.has(fence), also=lambda: intruder.put(fence, b"control"))
    for key in MESSAGES | REQUESTS:
        intruder.put(B + key, b"intruder")
    watching.samples.clear()
    until(lambda: watching.has(fence), also=lambda: intruder.put(fence, b"control"))
    crossable = shown_keys("b", "a", SHOWN)
    strange = {k for k, _ in watching.samples if not any(matches(one, k) for one in crossable)}
    assert strange == set()
    watching.close()


SERVERS = ("world", "traffic", "monitor", "eye", "parking")


def answering(session, keys, calls):
    def answer(query):
        calls.append(str(query.selector))
        query.reply(query.key_expr, b"done")
        query.drop()

    return [
        session.declare_queryable(key, zenoh.handlers.Callback(answer, indirect=False))
        for key in keys
    ]


def replies(session, key, timeout_s=1.0):
    return [reply.ok for reply in session.get(key, timeout=timeout_s) if reply.ok is not None]


@pytest.fixture(scope="module")
def served(cities, honest):
    """Return the calls that city a has answered; its parts answer all that they may."""
    calls, declared = [], []
    for name in SERVERS:
        session, keys = cities.raw("a", name), rights_of("part", name).services
        keys += (HANDOVER + "*",) if name == "world" else ()
        declared += answering(session, [A + key for key in keys], calls)
    yield calls
    for one in declared:
        one.undeclare()


def test_intruder_may_request_a_hand_over_and_nothing_else(served, honest, intruder):
    handover = A + HANDOVER + "b"
    until(lambda: bool(replies(intruder, handover)))
    until(lambda: bool(replies(honest, A + "world/stop_request")))
    served.clear()
    others = {HANDOVER + name for name in ("a", "c", "*")}
    for key in sorted(REQUESTS | others | {"v/*/lease", "world/*", "**", "v/n1/cmd/estop"}):
        found = replies(intruder, A + key, 0.1)
        assert [str(reply.key_expr) for reply in found if str(reply.key_expr) != handover] == []
    assert set(served) <= {handover}


def test_intruder_cannot_answer_requests_of_the_city(honest, intruder):
    calls = []
    declared = answering(intruder, [A + key for key in (*REQUESTS, "**")], calls)
    NEVER.wait(0.3)
    for key in REQUESTS - {"any/thing"}:
        replies(honest, A + key, 0.1)
    assert [call for call in calls if call.startswith(A)] == []
    for one in declared:
        one.undeclare()


def test_intruder_is_not_present_in_the_city_and_does_not_see_who_is(cities, honest, intruder):
    mark = f"alive/{intruder.zid()}"
    tokens = [
        intruder.liveliness().declare_token(A + key + mark)
        for key in ("part/world/", "v/n1/", "client/selftest/")
    ]
    own = cities.raw("a", "world").liveliness().declare_token(A + "part/world/alive/own")
    present = lambda who: {str(r.ok.key_expr) for r in who.liveliness().get(A + "**") if r.ok}  # noqa: E731
    until(lambda: A + "part/world/alive/own" in present(honest))
    assert not any(key.endswith(mark) for key in present(honest))
    seen = present(intruder)
    assert not any(key.endswith("alive/own") for key in seen)
    for token in (*tokens, own):
        token.undeclare()


@pytest.mark.parametrize("cities", ["mtls"], indirect=True)
def test_station_of_the_neighbour_is_no_gateway(cities):
    if "a" not in cities.routers:
        cities.start("a")
    honest, gateway = cities.raw("a", "selftest"), cities.rogue_gateway()
    station = cities.rogue_gateway("world")
    by_gateway, by_station = Seen(gateway, A + "v/*/state"), Seen(station, A + "v/*/state")
    of_b = Seen(honest, B + "v/*/state")
    until(lambda: bool(station.info.links()))
    station.put(B + "v/forged/state", b"forged")
    until(lambda: by_gateway.has(A + STATE), also=lambda: honest.put(A + STATE, b"control"))
    until(lambda: of_b.has(B + STATE), also=lambda: gateway.put(B + STATE, b"control"))
    station.put(B + "v/forged/state", b"forged")
    NEVER.wait(0.3)
    assert by_station.samples == []
    assert not of_b.has(B + "v/forged/state")


def test_every_name_that_a_map_may_choose_stands_for_keys():
    assert set(SHOWN) == set(NEIGHBOUR_MESSAGES)
    published = {key for one in all_rights() for key in one.publishes}
    for keys in SHOWN.values():
        for key in keys:
            assert any(matches(wide.replace("{me}", "*"), example(key)) for wide in published)


def test_gateway_s_station_is_named_after_its_neighbour():
    assert gateway_station("lab_b") == GATEWAY + "lab_b"
    assert rights_of("part", "gateway-lab_b").publishes[0] == "part/gateway-lab_b/status"
