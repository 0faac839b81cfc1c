import asyncio
import json

import pytest

from scm.api.acknowledgements import Acknowledgements
from scm.api.city import City
from scm.api.stream import EVENTS_SHOWN, HEARTBEAT_FRAMES, QUEUE_DEPTH, Listener, Stream
from scm.clock import StepClock
from scm.store.memory import MemoryStore


@pytest.fixture
def stream(view, fake_city, city_map):
    seen = Acknowledgements(MemoryStore(), StepClock())
    return Stream(City(view, fake_city.ask, city_map), "run1", seen)


def parsed(frame):
    fields = dict(line.split(": ", 1) for line in frame.decode().strip().split("\n") if line)
    return fields["event"], fields["id"], json.loads(fields["data"])


async def begin(stream, last_event_id=""):
    page = stream.listen(last_event_id)
    return page, parsed(await anext(page))


def test_a_page_first_gets_everything(stream, hear, snapshot, event):
    async def scenario():
        hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)), event("hello"))
        _, (name, _, body) = await begin(stream)
        assert name == "snapshot"
        assert set(body) == {
            "acknowledgements", "signal_status", "vehicles", "pulse", "signals", "boxes", "stop",
            "eye", "stations", "events", "run", "autonomy", "room_maps", "twins",
        }  # fmt: skip
        assert body["vehicles"]["vehicles"][0]["vehicle"] == "n1"
        assert [item["text"] for item in body["events"]] == ["hello"]

    asyncio.run(scenario())


def test_then_it_gets_only_what_changed(stream, hear, snapshot):
    async def scenario():
        page, _ = await begin(stream)
        for _ in range(HEARTBEAT_FRAMES // 2):
            stream.send_frame()  # every topic was sent once now
        hear(1.0, snapshot(tick=2, n1=(0.5, 0.0, 0.0)))
        stream.send_frame()
        tick = None
        while tick != 2:
            name, _, body = parsed(await anext(page))
            tick = body["vehicles"]["tick"] if "vehicles" in body else None
        assert name == "delta"
        assert set(body) == {"vehicles"}

    asyncio.run(scenario())


def test_an_event_comes_once(stream, hear, event):
    async def scenario():
        page, _ = await begin(stream)
        hear(1.0, event("one"))
        stream.send_frame()
        hear(1.1, event("two"))
        stream.send_frame()
        texts = []
        while len(texts) < 2:
            _, _, body = parsed(await anext(page))
            texts += [item["text"] for item in body.get("events", [])]
        assert texts == ["one", "two"]

    asyncio.run(scenario())


def test_an_event_that_came_just_before_a_page_did_is_told_it_once(stream, hear, event):
    async def scenario():
        await begin(stream)  # somebody hears already: the next frame tells all what is new
        hear(1.0, event("one"))
        page, (_, _, body) = await begin(stream)
        told = [item["text"] for item in body["events"]]
        stream.send_frame()
        _, _, body = parsed(await anext(page))
        assert told + [item["text"] for item in body.get("events", [])] == ["one"]

    asyncio.run(scenario())


def test_a_page_that_fell_behind_is_told_each_event_once_all_the_same(stream, hear, event):
    async def scenario():
        page, _ = await begin(stream)
        texts = []
        for number in range(3 * QUEUE_DEPTH):
            hear(1.0 + number, event(str(number)))
            stream.send_frame()
            if number in (0, 1):  # as a page that keeps up
                _, _, body = parsed(await anext(page))
                texts += [item["text"] for item in body["events"]]
        name, _, body = parsed(await anext(page))
        assert name == "snapshot"
        texts += [item["text"] for item in body["events"]]
        assert texts == [str(number) for number in range(3 * QUEUE_DEPTH)]

    asyncio.run(scenario())


def test_an_id_from_beyond_the_end_skips_no_event_to_come(stream, hear, event):
    async def scenario():
        hear(1.0, event("old"))
        page, (_, own_id, body) = await begin(stream, "run1-1-999999999999999999999999999")
        assert (body["events"], own_id) == ([], "run1-0-1")
        hear(1.1, event("new"))
        stream.send_frame()
        _, _, body = parsed(await anext(page))
        assert [item["text"] for item in body["events"]] == ["new"]

    asyncio.run(scenario())


def test_all_pages_share_one_encoding(stream, hear, snapshot):
    async def scenario():
        first, _ = await begin(stream)
        second, _ = await begin(stream)
        hear(1.0, snapshot())
        stream.send_frame()
        assert await anext(first) is await anext(second)

    asyncio.run(scenario())


def test_a_page_that_comes_back_gets_the_events_it_missed(stream, hear, event):
    async def scenario():
        hear(1.0, event("seen"))
        page, (_, last_id, _) = await begin(stream)
        await page.aclose()
        hear(1.1, event("missed"))
        _, (_, _, body) = await begin(stream, last_id)
        assert [item["text"] for item in body["events"]] == ["missed"]

    asyncio.run(scenario())


def test_a_page_that_missed_too_many_events_gets_the_last_ones(stream, hear, event):
    async def scenario():
        hear(1.0, event("seen"))
        page, (_, last_id, _) = await begin(stream)
        await page.aclose()
        hear(1.1, *(event(str(number)) for number in range(EVENTS_SHOWN + 4)))
        _, (_, _, body) = await begin(stream, last_id)
        assert [item["seq"] for item in body["events"]] == list(range(6, EVENTS_SHOWN + 6))

    asyncio.run(scenario())


@pytest.mark.parametrize("last_id", ["other-1-1", "run1", "run1-1-x", "run1-1--1", "\x00"])
def test_an_id_of_another_run_or_of_nonsense_gets_the_last_events(stream, hear, event, last_id):
    async def scenario():
        hear(1.0, *(event(str(number)) for number in range(EVENTS_SHOWN + 5)))
        _, (_, _, body) = await begin(stream, last_id)
        assert [item["seq"] for item in body["events"]] == list(range(6, EVENTS_SHOWN + 6))

    asyncio.run(scenario())


def test_a_page_too_slow_gets_a_new_snapshot_instead_of_a_backlog(stream, hear, snapshot):
    async def scenario():
        page, _ = await begin(stream)
        for tick in range(QUEUE_DEPTH + 5):
            hear(1.0, snapshot(tick=tick))
            stream.send_frame()
        name, _, body = parsed(await anext(page))
        assert name == "snapshot"
        assert body["vehicles"]["tick"] == QUEUE_DEPTH + 4
        hear(1.0, snapshot(tick=99))
        stream.send_frame()
        name, _, body = parsed(await anext(page))
        assert (name, body["vehicles"]["tick"]) == ("delta", 99)

    asyncio.run(scenario())


def test_silence_is_broken_once_a_second(stream):
    async def scenario():
        page, _ = await begin(stream)
        for _ in range(4 * HEARTBEAT_FRAMES):
            stream.send_frame()
        names = []
        while "beat" not in names:
            names.append(parsed(await anext(page))[0])
        assert names.count("beat") == 1

    asyncio.run(scenario())


def test_closing_ends_every_page(stream):
    async def scenario():
        page, _ = await begin(stream)
        waiting = asyncio.ensure_future(anext(page, "end"))
        await asyncio.sleep(0)
        stream.close()
        assert await asyncio.wait_for(waiting, 20.0) == "end"
        assert stream.pages == 0

    asyncio.run(scenario())


def test_a_page_that_leaves_is_no_longer_fed(stream):
    async def scenario():
        page, _ = await begin(stream)
        assert stream.pages == 1
        await page.aclose()
        assert stream.pages == 0

    asyncio.run(scenario())


def test_a_frame_that_fails_does_not_end_the_stream(stream, view, caplog, monkeypatch):
    async def scenario():
        calls = []

        def fail_once():
            calls.append(1)
            if len(calls) == 1:
                raise ValueError("bad frame")
            stream.close()
            return picture()

        picture = view.picture
        monkeypatch.setattr(view, "picture", fail_once)
        await asyncio.wait_for(stream.run(), 20.0)
        assert len(calls) == 2

    asyncio.run(scenario())
    assert "stream_frame_failed" in caplog.text


def test_a_listener_behind_takes_no_more_until_it_was_told():
    async def scenario():
        listener = Listener(frozenset())
        for _ in range(QUEUE_DEPTH + 1):
            listener.offer(b"x", 0)
        listener.offer(b"y", 0)
        assert await listener.next_frame() is None
        assert listener.behind

    asyncio.run(scenario())


def test_a_large_citys_cars_come_in_every_fifth_frame_only(stream, hear, snapshot):
    async def scenario():
        page, _ = await begin(stream)
        told = 0
        for tick in range(50):
            crowd = {f"n{i}": (float(tick), float(i), 0.0) for i in range(1000)}
            hear(1.0 + tick, snapshot(1.0 + tick, tick, **crowd))
            stream.send_frame()
            if tick % 10 == 9:  # as a page that keeps up
                while page_frames(stream):
                    _, _, body = parsed(await anext(page))
                    told += "vehicles" in body
        assert told == 10

    def page_frames(stream):
        return any(listener._frames for listener in stream._listeners)

    asyncio.run(scenario())
