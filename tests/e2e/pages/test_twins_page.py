"""Watched cars as people see them: what changed, since when, and another version put in force."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS
from scm.runtime.part import BasePart, Service, Subscription
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.messages.twin_send_request import TwinSendRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.version_request import VersionRequest
from tests.e2e.pages.test_map_page import is_drawn
from tests.e2e.pages.town import BEGIN_NS, Town, town
from tests.e2e.pages.visiting import Visit, in_each_look, judge, photograph
from tests.unit.api.made_twins import blind, floor_changed, undecided, watched

PLACE_EDGE = [255, 176, 0]
NOW_NS = BEGIN_NS + 1_200_000_000_000


class TwinStub(BasePart):
    """Reports of three cars what a twin part may, and puts versions of n1 in force."""

    name, role, period_ns = "twin", "part", 200 * NS_PER_MS
    subscriptions: Sequence[Subscription] = ()
    services: Sequence[Service] = (Service(VersionRequest), Service(TwinSendRequest))

    def __init__(self) -> None:
        self.requests: list[Any] = []
        self.status, self.undecided = watched("n1", NOW_NS), undecided("n2", NOW_NS)

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Report; answer requests."""
        del now_ns
        answers = [Answer(item, self._use(item.message)) for item in inbox]
        return [*answers, self.status, self.undecided, blind("n3", NOW_NS),
                floor_changed("n4", NOW_NS)]  # fmt: skip

    def _use(self, request: Any) -> TwinStatus:
        self.requests.append(request)
        if isinstance(request, TwinSendRequest):
            self.undecided = undecided("n2", NOW_NS, state="under_way", by=request.by, sent=1)
            return self.undecided
        by = {"by": request.by, "reason": request.reason}
        first, second, third = self.status.versions
        first = replace(first, state="adopted", **by)
        chosen = (first, replace(second, state="rolled_back", **by), third)
        self.status = replace(self.status, version=request.version, versions=chosen)
        return self.status


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Town]:
    """A town without a twin part."""
    with town("driving_school", tmp_path_factory.mktemp("town"), cars=3) as process:
        yield process


def look_at(visited: Visit, name: str) -> None:
    """Judge the open page in each size and theme, and keep a picture of each."""
    for size, theme in in_each_look(visited):
        judge(visited)
        photograph(visited, f"{name}_{size}_{theme}")


def test_city_without_the_part_says_how_to_start_it(visit: Callable[..., Visit]) -> None:
    visited = visit("/twins")
    page = visited.page
    page.wait_for_selector(".nobody code >> text=scm up driving_school --twin")
    look_at(visited, "twins_nobody")
    page.goto(page.url + "/n1")
    page.wait_for_selector(".nobody code >> text=scm up --twin")


def test_changes_are_shown_and_another_version_is_put_in_force(
    visit: Callable[..., Visit], running: Town
) -> None:
    with running.joined(stub := TwinStub()):
        visited = visit("/twins")
        page = visited.page
        page.wait_for_selector("tr[data-car=n1] >> text=Looks like tyre grip")
        page.wait_for_selector("tr[data-car=n2] >> text=12 min ago")
        assert "No command that it obeyed" in page.inner_text("tr[data-car=n3]")
        page.wait_for_selector("tr[data-car=n4] >> text=The floor at (1.2, 0.4), not the car")
        look_at(visited, "twins")
        page.click("tr[data-car=n1] a")
        named = page.wait_for_selector(".change[data-search=named]").inner_text()
        named = named.replace("\N{MINUS SIGN}", "-")
        for words in ("1.8° to the right", "over 99.9 % sure", "-1.78°", "-1.91° to -1.65°"):
            assert words in named
        assert page.get_attribute(".change a", "href") == "/mismatch/twin-n1-300"
        assert page.locator(".change[data-search=searching] a").count() == 0
        assert "4.10 cm → 1.82 cm" in page.inner_text("[data-version='1'] .errors")
        look_at(visited, "twin")
        page.click("[aria-label='Use version 0']")
        page.fill("dialog input[name=reason]", "wheels straightened")
        judge(visited, "dialog")
        photograph(visited, "twin_dialog")
        page.keyboard.press("Enter")
        page.wait_for_selector("[data-version='0'] .badge >> text=in force")
        page.wait_for_selector("[data-version='1'] >> text=by dashboard: wheels straightened")
        (request,) = stub.requests
        assert (request.version, request.by) == (0, "dashboard")
        page.goto(f"{running.url}/twins/n2")
        page.wait_for_selector(".change h2 >> text=Looks like steer trim or gyro bias")
        page.wait_for_selector(".decides >> text=Drive a circle")
        page.wait_for_selector(".decides >> text=Let n1 drive through (1.2, 0.4)")
        page.wait_for_selector("dd >> text=undecided: the car itself 62 %, the floor everywhere")
        look_at(visited, "twin_undecided")
        page.click(".decides button >> text=Send n1")
        page.fill("dialog input[name=reason]", "it stands about")
        judge(visited, "dialog")
        photograph(visited, "twin_send_dialog")
        page.keyboard.press("Enter")
        page.wait_for_selector(".decides >> text=n1 is under way, sent by dashboard")
        look_at(visited, "twin_under_way")
        request = stub.requests[-1]
        assert (request.vehicle, request.send, request.reason) == ("n2", "n1", "it stands about")
        page.goto(f"{running.url}/twins/n4")
        page.wait_for_selector(
            ".change h2 >> text=Not the car: the floor within 0.3 m of (1.2, 0.4)"
        )
        look_at(visited, "twin_floor")
        page.goto(f"{running.url}/map")
        is_drawn(page, PLACE_EDGE, 200)
        photograph(visited, "twin_place")
        page.goto(f"{running.url}/vehicles/n1")
        line = "watching, version 0, changed 70 s ago: looks like tyre grip"
        page.wait_for_selector(f"[data-fact=twin] a[href='/twins/n1'] >> text={line}")
        photograph(visited, "twin_vehicle")
    page.goto(f"{running.url}/twins")
    page.wait_for_selector(".all .warn >> text=The twin part is gone")
