"""The binary stream: its documented layout, one encoding for all, the newest for the slow."""

import asyncio
import json
import struct

import msgspec
import numpy as np
import pytest

from scm.api.vehicle_frames import COLUMNS, NAMES, STATES, VERSION, VehicleFrames, Words
from scm.v2x.messages.trip import Trip


@pytest.fixture
def frames(view):
    return VehicleFrames(view)


def trip(vehicle, length_m=7.5, waiting_for=None, arrived_ns=None):
    return Trip(
        vehicle=vehicle,
        trip_id="t1",
        t_ns=1,
        route=("a",),
        done_m=2.5,
        length_m=length_m,
        started_ns=0,
        waiting_for=waiting_for,
        arrived_ns=arrived_ns,
    )


def read(stream):
    """Read frames by the documented layout alone; names by generation, and the last states."""
    names, states = {}, None
    while stream:
        size, version, kind, zero = struct.unpack_from("<IBBH", stream)
        body, stream = stream[8 : 4 + size], stream[4 + size :]
        assert (version, zero) == (VERSION, 0)
        if kind == NAMES:
            told = json.loads(body)
            names[told["generation"]] = told
        else:
            assert kind == STATES
            states = body
    generation, count, t_s, age_ms, factor = struct.unpack_from("<IIdff", states)
    columns = np.frombuffer(states, "<f4", count * len(COLUMNS), 24).reshape(len(COLUMNS), count)
    flags = np.frombuffer(states, "<u4", count, 24 + columns.nbytes)
    assert len(states) == 24 + columns.nbytes + flags.nbytes
    return names, generation, dict(zip(COLUMNS, columns, strict=True)), flags, (t_s, age_ms, factor)


def test_a_viewer_reads_names_and_states_by_the_documented_layout(frames, hear, snapshot):
    async def scenario():
        hear(1.0, snapshot(1.0, n2=(1.0, 2.0, 3.0), n1=(0.25, -0.5, 0.5)), trip("n2"))
        return read(await anext(frames.listen()))

    names, generation, columns, flags, (t_s, age_ms, factor) = asyncio.run(scenario())
    table = names[generation]
    assert [car["vehicle"] for car in table["vehicles"]] == ["n1", "n2"]
    assert table["vehicles"][0]["kind"] == "hosted"
    assert columns["x_m"].tolist() == [0.25, 1.0]
    assert columns["y_m"].tolist() == [-0.5, 2.0]
    assert columns["yaw_rad"].tolist() == [0.5, 3.0]
    np.testing.assert_allclose(columns["speed_mps"], 0.2, rtol=1e-6)
    assert np.isnan(columns["done_m"][0])
    assert (columns["done_m"][1], columns["length_m"][1]) == (2.5, 7.5)
    assert (flags & 1).tolist() == [1, 1]
    assert [table["modes"][flag >> 1 & 31] for flag in flags] == ["drive", "drive"]
    assert (t_s, age_ms, factor) == (1.0, 0.0, 1.0)


def test_a_route_without_end_is_endless_and_one_that_ended_is_no_trip(frames, hear, snapshot):
    async def scenario():
        cars = snapshot(1.0, n1=(0, 0, 0), n2=(1, 0, 0))
        hear(1.0, cars, trip("n1", None, "signal"), trip("n2", arrived_ns=5))
        return read(await anext(frames.listen()))

    names, generation, columns, flags, _ = asyncio.run(scenario())
    assert columns["length_m"][0] == np.inf
    assert np.isnan(columns["length_m"][1])
    waits = [names[generation]["waits"][flag >> 6 & 31] for flag in flags]
    assert waits == ["signal", ""]


def test_a_car_that_is_stuck_tells_that_as_its_mode(frames, hear, snapshot):
    async def scenario():
        told = snapshot(1.0, n1=(0, 0, 0), n2=(1, 0, 0))
        stuck, other = told.vehicles
        stuck = msgspec.structs.replace(stuck, stuck=())
        hear(1.0, msgspec.structs.replace(told, vehicles=(stuck, other)))
        return read(await anext(frames.listen()))

    names, generation, _, flags, _ = asyncio.run(scenario())
    modes = [names[generation]["modes"][flag >> 1 & 31] for flag in flags]
    assert modes == ["stuck", "drive"]


def test_names_are_told_again_only_when_they_changed(frames, hear, snapshot):
    async def scenario():
        hear(1.0, snapshot(1.0, n1=(0, 0, 0)))
        viewer = frames.listen()
        first = await anext(viewer)
        hear(1.1, snapshot(1.1, 2, n1=(1, 0, 0)))
        assert frames.look()
        same = await anext(viewer)
        hear(1.2, snapshot(1.2, 3, n1=(1, 0, 0), n2=(2, 0, 0)))
        assert frames.look()
        more = await anext(viewer)
        told = snapshot(1.3, 4, n1=(1, 0, 0), n2=(2, 0, 0))
        first_car, other = told.vehicles
        stopped = msgspec.structs.replace(first_car, mode="stop")
        hear(1.3, msgspec.structs.replace(told, vehicles=(stopped, other)))
        assert frames.look()
        return first, same, more, await anext(viewer)

    told = [read(frame)[0] for frame in asyncio.run(scenario())]
    assert [names.keys() for names in told] == [{1}, set(), {2}, {3}]
    assert "stop" in told[3][3]["modes"], "a word that is new, of cars that are not"


def test_a_slow_viewer_gets_the_newest_and_no_backlog(frames, hear, snapshot):
    async def scenario():
        hear(1.0, snapshot(1.0, n1=(0, 0, 0)))
        viewer = frames.listen()
        await anext(viewer)
        for tick in range(2, 9):
            hear(1.0 + 0.05 * tick, snapshot(1.0 + 0.05 * tick, tick, n1=(tick, 0, 0)))
            frames.look()
        return read(await anext(viewer))[2]["x_m"].tolist()

    assert asyncio.run(scenario()) == [8.0]


def test_all_viewers_share_one_encoding_and_nothing_is_encoded_for_nobody(
    frames, hear, snapshot, monkeypatch
):
    encoded = []
    encode = frames._encode
    monkeypatch.setattr(frames, "_encode", lambda held: (encoded.append(held), encode(held)))

    async def scenario():
        hear(1.0, snapshot(1.0, n1=(0, 0, 0)))
        assert not frames.look()
        viewers = [frames.listen() for _ in range(3)]
        bodies = [await anext(viewer) for viewer in viewers]
        await asyncio.gather(*(viewer.aclose() for viewer in viewers))
        hear(1.1, snapshot(1.1, 2, n1=(0, 0, 0)))
        assert not frames.look()
        return bodies

    bodies = asyncio.run(scenario())
    assert len(encoded) == 1
    assert bodies[0] == bodies[1] == bodies[2]


def test_the_end_of_the_server_ends_every_stream(frames, hear, snapshot):
    async def scenario():
        hear(1.0, snapshot(1.0, n1=(0, 0, 0)))
        viewer = frames.listen()
        await anext(viewer)
        rest = asyncio.create_task(anext(viewer, None))
        await asyncio.sleep(0)
        frames.close()
        return await rest

    assert asyncio.run(scenario()) is None


def test_a_city_that_is_still_silent_keeps_its_viewers_waiting(frames, hear, snapshot):
    async def scenario():
        first = asyncio.create_task(anext(frames.listen()))
        await asyncio.sleep(0)
        frames._notify()
        await asyncio.sleep(0)
        assert not first.done()
        hear(1.0, snapshot(1.0, n1=(0, 0, 0)))
        frames.look()
        return read(await first)[1]

    assert asyncio.run(scenario()) == 1


def test_words_beyond_the_bits_share_the_last_number():
    words = Words(3, "")
    assert [words.number(word) for word in ("a", "b", "c", "a")] == [1, 2, 2, 1]
    assert words.list == ["", "a", "b"]
