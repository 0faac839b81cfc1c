"""Every message of `scm/v2x/messages`: what each of them must keep to, whoever adds one."""

import importlib
from functools import cache
from string import ascii_lowercase, digits
from types import NoneType, UnionType
from typing import Annotated, Literal, Union, get_args, get_origin

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scm.registry import names
from scm.v2x.key import agrees, key_of, matches, parse, selector, variables
from scm.v2x.message import Delivery, Message, Request, decode, encode, is_bulk
from scm.v2x.messages import message_classes

PACKAGE = "scm.v2x.messages"

PLAIN_NUMBERS = {
    "likely_confidence": "a share",
    "seq": "a count",
    "epoch": "a count",
    "tick": "a count",
    "late_ticks": "a count",
    "late_steps": "a count",
    "steps": "a count",
    "cars": "a count",
    "dropped": "a count",
    "beams": "a count",
    "laps": "a count",
    "boxes": "a count",
    "wanted": "a count",
    "entered": "a count",
    "arrived": "a count",
    "refused": "a count",
    "queued": "a count",
    "longest_queue": "a count",
    "passed": "a count",
    "stops": "a count",
    "queue": "a count",
    "queue_most": "a count",
    "saturation": "a share of what could pass",
    "size": "in the unit that stands beside it",
    "certainty": "a probability",
    "contacts": "a count",
    "revision": "a count",
    "number": "an identity",
    "seed": "a seed",
    "encoder_left": "counts of the encoder",
    "encoder_right": "counts of the encoder",
    "throttle": "a share of the greatest",
    "steering": "a share of the greatest",
    "margin": "of the tag detector, in its own measure",
    "hamming": "a count of bits",
    "distortion": "coefficients of a lens",
    "views": "a count",
    "covariance": "mixed, see the docstring",
    "shared_covariance": "mixed, see the docstring",
    "lean_covariance": "mixed, see the docstring",
    "real_time_factor": "a ratio",
    "score": "a sum of doubts, see its docstring",
    "plausibility": "a probability",
    "battery_charge": "a share of full",
    "claims": "a count",
    "sent": "a count of frames",
    "delivered": "a count of frames",
    "out_of_range": "a count of frames",
    "by_chance": "a count of frames",
    "by_distance": "a count of frames",
    "by_load": "a count of frames",
    "unknown": "a count of frames",
    "late": "a count of frames",
    "waiting": "a count of frames",
    "busy": "a share of time",
    "attempts": "a count",
    "rows": "a count",
    "columns": "a count",
    "explained": "a share",
    "compute_share": "a share of time",
    "path": "mixed, see the docstring",
    "trajectory": "mixed, see the docstring",
    "candidates": "mixed, see the docstring",
    "particles": "mixed, see the docstring",
    "obstacles": "mixed, see the docstring",
    "busy_mean": "a share of time",
    "busy_most": "a share of time",
    "start": "a pose of the map, see its docstring",
    "top": "a share of the frame's height",
    "probability": "a probability",
    "value": "of a parameter, whose name says the unit",
    "low": "of a parameter, whose name says the unit",
    "high": "of a parameter, whose name says the unit",
    "before": "of a parameter or an error, whose name says the unit",
    "now": "of an error, whose name says the unit",
    "version": "an identity",
    "after": "an identity",
    "windows": "a count",
    "saliency": "of the steering command, see its docstring",
    "values": "of a variable, whose name stands beside it",
    "knots": "mixed, see vehicles.command_delay",
    "newest": "a count",
    "integral": "a share of the greatest throttle",
    "origin": "a pose, see its docstring",
    "border": "a pose, see its docstring",
    "drawn_as": "in ampere seconds",
}
UNITS = tuple(
    f"_{unit}"
    for unit in (
        *("ns", "ms", "s", "m", "px", "rad", "deg", "hz"),
        *("mps", "mps2", "radps", "n", "nm", "kg", "v", "a", "w", "j", "c"),
        *("id", "number"),
    )
)
ETSI = "scm.v2x.etsi."  # modules whose numbers are in the units of the standards


def defined_classes():
    classes = []
    for name in names(PACKAGE):
        module = importlib.import_module(f"{PACKAGE}.{name}")
        for thing in vars(module).values():
            is_class = isinstance(thing, type) and thing.__module__ == module.__name__
            if is_class and issubclass(thing, Message):
                classes.append(thing)
    return list(dict.fromkeys(classes))


CLASSES = defined_classes()
SENT = message_classes()
every_class = pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
every_sent = pytest.mark.parametrize("kind", SENT, ids=lambda kind: kind.__name__)

NAME = st.text(ascii_lowercase + digits + "_-", min_size=1, max_size=32)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
WORDS = st.text(st.characters(codec="utf-8"), max_size=8)
OF_TYPE = {
    int: st.integers(-(2**63), 2**63 - 1),
    float: FINITE,
    bool: st.booleans(),
    str: WORDS,
    bytes: st.binary(max_size=64),
    NoneType: st.none(),
}


def values(of):
    """Return a strategy for values of a field's type."""
    if isinstance(of, type) and issubclass(of, msgspec.Struct):
        return structs(of)
    origin, inner = get_origin(of), get_args(of)
    if origin in (Union, UnionType):
        return st.one_of(*(values(t) for t in inner))
    if origin is Literal:
        return st.sampled_from(inner)
    if origin is Annotated:
        return annotated(*inner)
    if origin is tuple and inner[-1] is Ellipsis:
        return st.lists(values(inner[0]), max_size=3).map(tuple)
    if origin is tuple:
        return st.tuples(*(values(t) for t in inner))
    return OF_TYPE[of]


def annotated(of, meta):
    """Return a strategy for a type with limits, or with a description alone."""
    limits = ("ge", "gt", "le", "lt", "min_length", "max_length", "pattern")
    if all(getattr(meta, limit) is None for limit in limits):
        return values(of)
    if of is int:
        return st.integers(meta.ge, meta.le)
    if of is not str:
        least = meta.min_length or 0
        items = st.lists(values(get_args(of)[0]), min_size=least, max_size=max(2, least))
        return items.map(tuple)
    if meta.pattern:
        return st.from_regex(meta.pattern.replace("$", r"\Z"))
    characters = st.characters(codec="ascii")
    return st.text(characters, min_size=meta.min_length or 0, max_size=meta.max_length)


@cache
def structs(kind):
    """Return a strategy for messages of a class, one for all tests: hypothesis prepares it once."""
    in_key = variables(kind) if issubclass(kind, Message) else []
    fields = {}
    for field in msgspec.structs.fields(kind):
        is_text = str in (field.type, getattr(field.type, "__origin__", None))
        is_name = field.name in in_key and is_text
        fields[field.name] = NAME if is_name else values(field.type)
    return st.builds(kind, **fields)


@every_class
@settings(max_examples=10)  # of each of 140 classes; a field that is lost is seen in the first
@given(data=st.data())
def test_it_is_read_back_equal_from_bytes_of_now_of_old_and_of_the_future(kind, data):
    message = data.draw(structs(kind))
    body, attachment = encode(message)
    assert decode(kind, body, attachment) == message
    if kind in SENT:
        has_its_key(kind, message)
    fields = msgspec.json.decode(attachment if is_bulk(kind) else body)
    assert read(kind, body, {**fields, "from_the_future": 1}) == message
    for field in msgspec.structs.fields(kind):
        if not field.required:
            fields.pop(field.name, None)
    of_old = read(kind, body, fields)
    for field in msgspec.structs.fields(kind):
        expected = getattr(message, field.name) if field.required else field.default
        assert getattr(of_old, field.name) == expected


def has_its_key(kind, message):
    """Check that a message's key is built, parsed and selected."""
    key = key_of("city", message)
    assert parse("city", kind, key) == {n: str(getattr(message, n)) for n in variables(kind)}
    assert matches(selector("city", kind, {}), key)
    assert agrees(key, message)


def read(kind, body, fields):
    """Read a message from other fields than were written."""
    altered = msgspec.json.encode(fields)
    return decode(kind, body, altered) if is_bulk(kind) else decode(kind, altered)


@pytest.mark.parametrize("name", names(PACKAGE))
def test_the_file_is_named_after_its_class(name):
    module = importlib.import_module(f"{PACKAGE}.{name}")
    own = "".join(word.capitalize() for word in name.split("_"))
    kinds = [kind.__name__ for kind in message_classes() if kind.__module__ == module.__name__]
    assert kinds in ([own], [f"{own}Tx", f"{own}Rx"])


@pytest.mark.parametrize("kind", [kind for kind in SENT if issubclass(kind, Request)])
@settings(max_examples=3)
@given(data=st.data())
def test_a_request_says_who_answers_it(kind, data):
    message = data.draw(structs(kind))
    assert kind.SERVER != Request.SERVER
    assert message.server.startswith("the ")
    named = [name for name in variables(kind) if name in kind.SERVER]
    assert all(str(getattr(message, name)) in message.server for name in named)
    assert "{" not in message.server


def numeric_fields(kind):
    """Yield (path, name) of every field that holds numbers, those of inner structs included."""
    for field in msgspec.structs.fields(kind):
        yield from _numeric(f"{kind.__name__}.{field.name}", field.name, field.type)


def _numeric(path, name, of):
    if isinstance(of, type) and issubclass(of, msgspec.Struct):
        if not of.__module__.startswith(ETSI) and of.__module__ != "scm.records.city_map":
            yield from numeric_fields(of)
    elif of in (int, float):
        yield path, name
    else:
        for inner in get_args(of):
            if isinstance(inner, type) or get_args(inner):
                yield from _numeric(path, name, inner)


@every_class
def test_every_number_says_its_unit_in_its_name(kind):
    bare = {
        path
        for path, name in numeric_fields(kind)
        if not name.endswith(UNITS) and name not in PLAIN_NUMBERS
    }
    assert not bare, f"no unit in the name, and not in the list of plain numbers: {sorted(bare)}"


@every_sent
def test_its_rate_and_delivery_fit_together(kind):
    if issubclass(kind, Request):
        assert kind.DELIVERY is Delivery.RPC
        assert kind.RATE_HZ is None
        assert issubclass(kind.REPLY, Message)
        assert kind.REPLY is not Message
    if kind.DELIVERY is Delivery.STREAM:
        assert kind.RATE_HZ is not None
        assert 0.1 <= kind.RATE_HZ <= 100.0
    assert kind.HISTORY_DEPTH >= 1


@every_sent
def test_messages_that_are_not_asked_for_say_when_they_were_true(kind):
    if not issubclass(kind, Request) and kind.DELIVERY is not Delivery.PRESENCE:
        assert "t_ns" in kind.__struct_fields__


def test_no_two_messages_share_a_key():
    patterns = {}
    for kind in SENT:
        pattern = selector("city", kind, {})
        assert pattern not in patterns, f"{kind.__name__} and {patterns.get(pattern)}: {pattern}"
        patterns[pattern] = kind.__name__
