"""Events filtered, acknowledged and exported; deeds noted, filtered and checked."""

import asyncio
import csv
import io
import json
import threading
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import partial

import httpx
import msgspec
import pytest
from starlette.responses import Response

from scm.api import app as application
from scm.api.acknowledgements import MAX_ACKNOWLEDGEMENTS, Acknowledgements
from scm.api.app import create_app
from scm.api.audit_trail import Audited
from scm.api.event_log import EventLog, id_of
from scm.api.limits import Limited, Policy
from scm.clock import StepClock
from scm.errors import StoreError
from scm.store.audit import AuditLog, Deed
from scm.store.memory import MemoryStore
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest

API = "/api/v1"


def told(text, severity="info", source="world", t_ns=1, name="told", vehicle=None):
    return CityEvent(
        severity=severity, source=source, t_ns=t_ns, name=name, text=text, vehicle=vehicle
    )


LOG = (
    told("n1 touched a wall", "warning", t_ns=10, name="contact", vehicle="n1"),
    told("plan calm is in force", source="traffic", t_ns=20, name="plan_changed"),
    told("n2 touched a Wall", "warning", t_ns=30, name="contact", vehicle="n2"),
    told("the monitor latched a fault", "error", source="monitor", t_ns=40, name="fault"),
)


@pytest.fixture
def store():
    return MemoryStore()


@pytest.fixture
def own_client(view, fake_city, city_map, store, client_of):
    return client_of(create_app(view, fake_city.ask, city_map, state=store))


def texts(answer):
    return [row["text"] for row in answer.json()["items"]]


class TestFilter:
    @pytest.mark.parametrize(
        ("query", "found"),
        [
            ("severity=warning", [2, 0]),
            ("severity=warning,error", [3, 2, 0]),
            ("source=traffic", [1]),
            ("name=contact&vehicle=n1", [0]),
            ("vehicle=n", []),
            ("text=WALL", [2, 0]),
            ("text=monitor", [3]),
            ("text=plan%20changed", [1]),
            ("text=PLAN_CALM", [1]),
            ("since_ns=20&until_ns=30", [2, 1]),
            ("", [3, 2, 1, 0]),
        ],
    )
    def test_only_what_is_wanted_is_told_newest_first(self, client, hear, query, found):
        hear(1.0, *LOG)
        assert texts(client("GET", f"{API}/events?{query}")) == [LOG[i].text for i in found]

    def test_a_file_holds_what_the_filter_lets_through(self, client, hear):
        hear(1.0, *LOG)
        answer = client("GET", f"{API}/events.csv?severity=warning")
        rows = list(csv.DictReader(io.StringIO(answer.text)))
        assert [row["text"] for row in rows] == ["n2 touched a Wall", "n1 touched a wall"]
        assert answer.headers["content-disposition"].endswith('-events.csv"')
        lines = client("GET", f"{API}/events.jsonl?vehicle=n1").text.splitlines()
        assert [json.loads(line)["name"] for line in lines] == ["contact"]

    def test_a_spreadsheet_runs_nothing_that_a_car_said(self, client, hear):
        hear(1.0, told('=HYPERLINK("x")'))
        assert "'=HYPERLINK" in client("GET", f"{API}/events.csv").text

    def test_there_is_no_file_of_another_form(self, client):
        assert client("GET", f"{API}/events.xlsx").status_code == 422


class TestIds:
    def test_an_event_heard_again_after_a_restart_has_the_same_id(self):
        first, second = EventLog(), EventLog()
        for event in LOG:
            first.add(event)
        second.add(LOG[2])
        assert second.after(0, 9)[0].id == first.after(2, 1)[0].id
        assert len({id_of(event) for event in LOG}) == len(LOG)


class TestAcknowledging:
    def test_what_was_seen_says_by_whom_and_is_no_longer_open(self, client, hear):
        hear(1.0, *LOG)
        wall = client("GET", f"{API}/events?vehicle=n1").json()["items"][0]
        body = {"events": [wall["id"]], "by": "ada", "note": "put back"}
        answer = client("POST", f"{API}/events/acknowledgements", json=body)
        assert answer.json()["acknowledgements"][0]["by"] == "ada"
        again = client("GET", f"{API}/events?vehicle=n1").json()["items"][0]
        assert (again["acknowledged_by"], again["note"]) == ("ada", "put back")
        assert LOG[0].text not in texts(client("GET", f"{API}/events?open=true"))
        assert client("DELETE", f"{API}/events/acknowledgements/{wall['id']}").status_code == 200
        assert LOG[0].text in texts(client("GET", f"{API}/events?open=true"))
        assert client("DELETE", f"{API}/events/acknowledgements/{wall['id']}").status_code == 404

    def test_who_takes_note_page_by_page_comes_to_the_end(self, client, hear):
        hear(1.0, *LOG)
        found, cursor = [], ""
        while cursor is not None:
            page = client("GET", f"{API}/events?open=true&limit=1&cursor={cursor}").json()
            ids, cursor = [row["id"] for row in page["items"]], page["next"]
            client("POST", f"{API}/events/acknowledgements", json={"events": ids})
            found += ids
        assert found == [id_of(event) for event in reversed(LOG)]

    def test_without_a_name_it_was_the_program_that_called(self, client, hear):
        hear(1.0, *LOG)
        body = {"events": [id_of(LOG[0])]}
        answer = client("POST", f"{API}/events/acknowledgements", json=body).json()
        assert answer["acknowledgements"][0]["by"] == "python-httpx"

    @pytest.mark.parametrize("body", [{"events": []}, {"events": ["x"]}, {"events": ["0" * 15]}])
    def test_what_is_no_id_is_refused(self, client, body):
        assert client("POST", f"{API}/events/acknowledgements", json=body).status_code == 422

    def test_it_outlives_the_server(self, store):
        clock = StepClock(7)
        Acknowledgements(store, clock).add(["a" * 16], "ada", "seen")
        (row,) = Acknowledgements(store, clock).rows().values()
        assert (row.by, row.note, row.at_ns) == ("ada", "seen", 7)

    def test_the_first_who_saw_it_stays(self, store):
        seen = Acknowledgements(store, StepClock(7))
        seen.add(["a" * 16], "ada")
        (row,) = seen.add(["a" * 16], "bob")
        assert row.by == "ada"

    def test_the_oldest_are_forgotten(self, store):
        seen = Acknowledgements(store, StepClock(7))
        ids = [f"{number:016x}" for number in range(MAX_ACKNOWLEDGEMENTS + 3)]
        seen.add(ids, "ada")
        assert list(seen.rows()) == ids[3:]
        assert len(list(store.items("seen"))) == MAX_ACKNOWLEDGEMENTS

    def test_who_looks_does_not_wait_for_a_slow_store(self, store, monkeypatch):
        seen = Acknowledgements(store, StepClock(7))
        seen.add(["a" * 16], "ada")
        begun, may_end = threading.Event(), threading.Event()
        put = store.put

        def put_slowly(*asked):
            begun.set()
            assert may_end.wait(60.0)
            put(*asked)

        monkeypatch.setattr(store, "put", put_slowly)
        with ThreadPoolExecutor(2) as threads:
            adding = threads.submit(seen.add, ["b" * 16], "bob")
            assert begun.wait(60.0)
            looking = threads.submit(seen.newest, 5)
            done, _ = wait([looking], 20.0)
            may_end.set()
            assert done
            assert [row.by for row in looking.result()] == ["ada"]
            adding.result(60.0)
        assert [row.by for row in seen.newest(5)] == ["ada", "bob"]

    def test_a_broken_record_is_named(self, store):
        store.put("seen", "event/x", b"{}")
        with pytest.raises(StoreError, match="event/x"):
            Acknowledgements(store, StepClock(7))


class TestAudit:
    def test_every_change_and_every_refusal_is_noted_and_looking_is_not(
        self, own_client, fake_city
    ):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        own_client("GET", f"{API}/stop")
        headers = {"Idempotency-Key": "k1"}
        own_client("PUT", f"{API}/stop", json={"engaged": True}, headers=headers)
        own_client("PUT", f"{API}/stop", json={"engaged": "never"})
        rows = own_client("GET", f"{API}/audit").json()["items"]
        assert [(row["kind"], row["reply"]["status"]) for row in rows] == [
            ("PUT /api/v1/stop", 422),
            ("PUT /api/v1/stop", 200),
        ]
        assert rows[1]["request_id"] == "k1"
        assert (rows[1]["by"], rows[1]["request"]["role"]) == ("python-httpx", "admin")

    def test_deeds_of_all_stations_are_told_newest_first_page_by_page(self, own_client, store):
        log = AuditLog(store)
        for number in range(1, 1203):
            log.note(Deed(t_ns=number, station="world", kind="StopRequest", by="ada"))
        first = own_client("GET", f"{API}/audit?limit=500").json()
        assert [first["items"][i]["number"] for i in (0, 499)] == [1202, 703]
        second = own_client("GET", f"{API}/audit?limit=500&cursor={first['next']}").json()
        assert [second["items"][i]["number"] for i in (0, 499)] == [702, 203]

    @pytest.mark.parametrize(
        ("query", "found"),
        [
            ("station=world", [1]),
            ("by=BOB", [2]),
            ("kind=plan", [2]),
            ("text=crossing", [2]),
            ("text=south_gate", [2]),
            ("text=South%20gate", [2]),
        ],
    )
    def test_deeds_are_filtered(self, own_client, store, query, found):
        log = AuditLog(store)
        log.note(Deed(t_ns=1, station="world", kind="StopRequest", by="ada"))
        request = json.dumps({"junction": "crossing", "reason": "south_gate"}).encode()
        log.note(
            Deed(t_ns=2, station="traffic", kind="PlanRequest", by="bob",
                 request=msgspec.Raw(request))
        )  # fmt: skip
        rows = own_client("GET", f"{API}/audit?{query}").json()["items"]
        assert [row["number"] for row in rows] == found

    def test_a_chain_that_was_tampered_with_is_called_so(self, own_client, store):
        log = AuditLog(store)
        for number in range(3):
            log.note(Deed(t_ns=number, station="world", kind="StopRequest"))
        whole = own_client("GET", f"{API}/audit/verdict").json()
        assert (whole["whole"], whole["entries"]) == (True, 3)
        store._logs["audit"][1] = (
            store._logs["audit"][1][:64] + b'{"t_ns":9,"station":"x","kind":"y"}'
        )
        broken = own_client("GET", f"{API}/audit/verdict").json()
        assert not broken["whole"]
        assert "entry 3" in broken["error"]

    def test_who_asks_too_often_does_not_fill_the_log(
        self, view, fake_city, city_map, store, client_of, monkeypatch
    ):
        once = Policy("changing", 1, 0.001)
        monkeypatch.setattr(application, "Limited", partial(Limited, changing=once))
        call = client_of(create_app(view, fake_city.ask, city_map, state=store))
        codes = [call("POST", f"{API}/boxes/reset").status_code for _ in range(3)]
        assert codes == [503, 429, 429]
        assert len(call("GET", f"{API}/audit").json()["items"]) == 1

    def test_a_slow_store_keeps_no_other_work_waiting(self, store, monkeypatch):
        begun, may_end = asyncio.Event(), threading.Event()
        loops = []

        def note_slowly(_log, _deed):
            loops[0].call_soon_threadsafe(begun.set)
            assert may_end.wait(60.0)

        async def scenario():
            loops.append(asyncio.get_running_loop())
            audited = Audited(Response("done"), store=store, clock=StepClock())
            transport = httpx.ASGITransport(audited)
            async with httpx.AsyncClient(transport=transport, base_url="http://city") as client:
                changes = [asyncio.create_task(client.put("/x")) for _ in range(40)]
                await begun.wait()
                try:
                    return await asyncio.wait_for(asyncio.to_thread(lambda: "renewed"), 20.0)
                finally:
                    may_end.set()
                    await asyncio.gather(*changes)

        monkeypatch.setattr(AuditLog, "note", note_slowly)
        assert asyncio.run(scenario()) == "renewed"

    def test_an_entry_that_is_none_hides_no_other_and_is_in_the_file(self, own_client, store):
        log = AuditLog(store)
        log.note(Deed(t_ns=1, station="world", kind="StopRequest"))
        store.append("audit", b"rubbish")
        log.note(Deed(t_ns=3, station="world", kind="StopRequest"))
        rows = own_client("GET", f"{API}/audit").json()["items"]
        assert [row["kind"] for row in rows] == ["StopRequest", "unreadable", "StopRequest"]
        assert len(own_client("GET", f"{API}/audit.jsonl").text.splitlines()) == 3

    @pytest.mark.parametrize("query", ["number=3", "digest=" + "a" * 64])
    def test_half_of_what_was_noted_is_not_taken_for_all(self, own_client, query):
        answer = own_client("GET", f"{API}/audit/verdict?{query}")
        assert (answer.status_code, answer.json()["code"]) == (422, "invalid")

    def test_a_store_that_fails_does_not_undo_the_change(
        self, own_client, fake_city, store, caplog
    ):
        fake_city.answers[StopRequest] = CityStop(t_ns=1, engaged=True)
        store.close()
        assert own_client("PUT", f"{API}/stop", json={"engaged": True}).status_code == 200
        assert "audit_failed" in caplog.text


def test_what_could_not_be_stored_is_said_so_and_was_not_done(
    view, hear, fake_city, city_map, client_of
):
    class Full(MemoryStore):
        @contextmanager
        def transaction(self):
            with super().transaction():
                yield
                raise StoreError("state city.db: database or disk is full")

    hear(1.0, *LOG)
    client = client_of(create_app(view, fake_city.ask, city_map, state=Full()))
    body = {"events": [id_of(LOG[0])]}
    answer = client("POST", f"{API}/events/acknowledgements", json=body)
    assert (answer.status_code, answer.json()["code"]) == (507, "not_written")
    assert "disk is full" in answer.json()["detail"]
    assert len(client("GET", f"{API}/events?open=true").json()["items"]) == len(LOG)
