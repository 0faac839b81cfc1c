"""The red stop comes first: it never waits behind what others ask of the server."""

import asyncio
import threading

import httpx
import pytest

from scm.api.app import create_app
from scm.v2x.message import Refused
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.stop_request import StopRequest

HERE = "http://127.0.0.1:8000"
THREADS = 40  # that answer requests


@pytest.fixture
def silent():
    """Hold a city that answers the stop alone; all else waits until `leave` is set."""

    class Silent:
        def __init__(self):
            self.leave, self.waiting = threading.Event(), threading.Semaphore(0)

        def ask(self, request, _timeout_s):
            if isinstance(request, StopRequest):
                return CityStop(t_ns=1, engaged=request.engaged)
            self.waiting.release()
            self.leave.wait(120.0)
            return Refused(code="timeout", detail="no answer")

    return Silent()


def test_the_stop_does_not_wait_for_a_thread(view, city_map, silent):
    async def press():
        transport = httpx.ASGITransport(create_app(view, silent.ask, city_map))
        async with httpx.AsyncClient(transport=transport, base_url=HERE) as client:
            others = [
                asyncio.create_task(client.post("/api/v1/boxes/reset")) for _ in range(THREADS + 10)
            ]
            try:
                for _ in range(THREADS):
                    await asyncio.to_thread(silent.waiting.acquire)
                return await asyncio.wait_for(
                    client.put("/api/v1/stop", json={"engaged": True}), 30.0
                )
            finally:
                silent.leave.set()
                await asyncio.gather(*others)

    answer = asyncio.run(press())
    assert (answer.status_code, answer.json()["engaged"]) == (200, True)
