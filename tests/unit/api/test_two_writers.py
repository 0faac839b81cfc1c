"""Of two who change the same thing at the same time one is obeyed, and the other one is told."""

import asyncio
import threading
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest

from scm.api import calibration_repository, recording_repository, scenarios, signal_plans
from scm.api.app import create_app
from scm.api.folders import folders_in
from scm.records.signal_plans import PlanProof
from tests.unit.api.conftest import HERE
from tests.unit.api.test_eye_routes import LENS, PLACE
from tests.unit.api.test_signal_routes import STAGES, site, status
from tests.unit.recorder.short_run import write_run

DEADLINE_S = 20.0
CHANGES = {
    "signals/crossing/plans/rush": [
        {"about": about, "by": "ada", "reason": "school", "stages": STAGES} for about in "abc"
    ],
    "eye/calibrations/lab": [{"toml": toml} for toml in (PLACE, LENS, PLACE + "# mine\n")],
    "scenarios/mine": [{"text": f"a = {number}\n"} for number in range(3)],
    "recordings/run/notes": [{"title": title} for title in "abc"],
}
DELETED = [path for path in CHANGES if path.split("/")[0] in ("signals", "eye", "scenarios")]


def proof(digest):
    return PlanProof(
        digest=digest, states=1, transitions=1, plan_states=1, plan_transitions=1, cycle_s=20.5,
        took_s=0.1,
    )  # fmt: skip


class Meeting:
    """Holds the first of two who change files, until the other one is there or finds it locked."""

    def __init__(self):
        self.is_on, self._came, self._lock = False, 0, threading.Lock()
        self._met = threading.Event()

    def come(self):
        with self._lock:
            self._came += self.is_on
            if self._came == 2:
                self._met.set()
        if self.is_on:
            assert self._met.wait(DEADLINE_S), "the other one neither came nor waited"

    def lock(self):
        return _Lock(self._met)


class _Lock:
    """A lock that tells when somebody has to wait for it."""

    def __init__(self, met):
        self._lock, self._met = threading.Lock(), met

    def __enter__(self):
        if not self._lock.acquire(blocking=False):
            self._met.set()
            assert self._lock.acquire(timeout=DEADLINE_S)

    def __exit__(self, *_):
        self._lock.release()


@pytest.fixture
def meeting(monkeypatch):
    meeting = Meeting()
    for module in (calibration_repository, recording_repository, scenarios, signal_plans):
        own = SimpleNamespace(**vars(threading) | {"Lock": meeting.lock})
        monkeypatch.setattr(module, "threading", own)
    for name in ("replace", "unlink"):
        do = getattr(Path, name)

        def change(path, *args, _do=do, **options):
            if path.suffix in (".part", ".json", ".toml", ".py"):
                meeting.come()
            return _do(path, *args, **options)

        monkeypatch.setattr(Path, name, change)
    return meeting


@pytest.fixture
def ask(meeting, view, hear, fake_city, city_map, tmp_path, monkeypatch):
    """Return how to send several requests at the same time."""
    folders = folders_in(tmp_path)
    write_run(folders.recordings / "run.mcap")
    monkeypatch.setattr(signal_plans.PlanRepository, "proof_of", lambda _, digest: proof(digest))
    app = create_app(view, fake_city.ask, city_map, folders=folders)
    hear(1.0, site(), status())

    def at_once(*requests):
        async def send():
            transport = httpx.ASGITransport(app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url=HERE) as client:
                own = [client.request(*one[:2], **one[2]) for one in requests]
                return await asyncio.gather(*own)

        return asyncio.run(send())

    return at_once


def seen(ask, path):
    """Write something for the first time, where one must; return the headers of who saw it."""
    at = f"/api/v1/{path}"
    if not path.startswith("recordings"):
        new = {"json": CHANGES[path][0], "headers": {"If-None-Match": "*"}}
        (made,) = ask(("PUT", at, new))
        assert made.status_code == 201, made.text
    (found,) = ask(("GET", at, {}))
    return {"If-Match": found.headers["etag"]}


@pytest.mark.parametrize("path", CHANGES)
def test_of_two_who_write_at_once_the_second_is_told(ask, meeting, path):
    headers = seen(ask, path)
    meeting.is_on = True
    puts = [
        ("PUT", f"/api/v1/{path}", {"json": body, "headers": headers}) for body in CHANGES[path][1:]
    ]
    assert sorted(answer.status_code for answer in ask(*puts)) == [200, 412]


@pytest.mark.parametrize("path", DELETED)
def test_of_a_writer_and_a_deleter_at_once_the_second_is_told(ask, meeting, path):
    headers = seen(ask, path)
    meeting.is_on = True
    write = ("PUT", f"/api/v1/{path}", {"json": CHANGES[path][1], "headers": headers})
    delete = ("DELETE", f"/api/v1/{path}", {"headers": headers})
    done, told = sorted(answer.status_code for answer in ask(write, delete))
    assert (done in (200, 204), told) == (True, 412)
