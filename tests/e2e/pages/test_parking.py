"""A car that parks itself, as people see it and send it to a goal; its agent is a stub."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.runtime.part import BasePart, Service
from scm.v2x.exchange import Answer, Incoming, Outgoing
from scm.v2x.grid_payload import packed
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.occupancy_map import OccupancyMap
from scm.v2x.messages.park_request import ParkReply, ParkRequest
from tests.e2e.pages.test_map_page import click_on, is_drawn, pixel_of
from tests.e2e.pages.town import Town
from tests.e2e.pages.visiting import Visit, in_both_themes, judge

ROADS = Roads(load_map("driving_school"))
GOAL, PATH, PARTICLE = (125, 255, 176), (90, 209, 255), (255, 122, 217)
WALL = (208, 255, 64)  # of a map that a car makes


class AgentStub(BasePart):
    """Accepts goals of n2, and reports to be on its way."""

    name, role, period_ns = "park-n2", "client", 200 * NS_PER_MS
    subscriptions, services = (), (Service(ParkRequest, {"vehicle": "n2"}),)

    def __init__(self) -> None:
        self.goals: list[str] = []
        self.status = AutonomyStatus(vehicle="n2", t_ns=0, state="idle", reason="no goal yet")

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Accept goals; report."""
        answers = [Answer(item, self._accept(item.message, now_ns)) for item in inbox]
        return [*answers, self.status, _plan(self.status, now_ns), _costmap(now_ns)]

    def _accept(self, request: Any, now_ns: int) -> ParkReply:
        goal = ROADS.spawn_pose(request.goal)
        self.goals.append(request.goal)
        self.status = AutonomyStatus(
            vehicle="n2", t_ns=now_ns, state="recover", reason="something stands in the way",
            goal_x_m=goal.x, goal_y_m=goal.y, goal_yaw_rad=goal.yaw,
            position_std_m=0.012, yaw_std_rad=0.01,
        )  # fmt: skip
        return ParkReply(vehicle="n2", x_m=goal.x, y_m=goal.y, yaw_rad=goal.yaw)


def _plan(status: AutonomyStatus, now_ns: int) -> AutonomyPlan:
    path = ((0.2, 0.2, 0.0), (1.2, 0.2, 0.0), (2.2, 0.2, 0.0))
    return AutonomyPlan(
        vehicle=status.vehicle, t_ns=now_ns, path=path, particles=path, obstacles=((1.0, 0.0),)
    )


def _costmap(now_ns: int) -> Costmap:
    return Costmap(
        vehicle="n2", t_ns=now_ns, rows=1, columns=2, cell_m=0.5, x_m=0.0, y_m=0.0, step_m=0.01,
        half_width_m=0.09, payload=packed(b"\x00\x20"),
    )  # fmt: skip


class MapStub(BasePart):
    """Reports to map a room about n2, whose four cells it has seen."""

    name, role, period_ns, subscriptions = "map-n2", "client", 200 * NS_PER_MS, ()

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Report."""
        del inbox
        reason = "goes on 0.9 m to see more"
        room = OccupancyMap(
            vehicle="n2", t_ns=now_ns, rows=2, columns=2, cell_m=0.2, x_m=0.3, y_m=-0.2,
            car_x_m=0.0, car_y_m=0.0, car_yaw_rad=0.0, state="map", path=((0.0, 0.0, 0.0),),
            payload=bytes((0, 100, 0, 255)),
        )  # fmt: skip
        return [AutonomyStatus(vehicle="n2", t_ns=now_ns, state="map", reason=reason), room]


@pytest.fixture
def agent(running: Town) -> Iterator[AgentStub]:
    stub = AgentStub()
    with running.joined(stub):
        yield stub


@pytest.fixture
def visited(agent: AgentStub, visit: Callable[..., Visit]) -> Visit:
    """The map with the car chosen, once its agent has reported."""
    del agent
    page = visit("/map?vehicle=n2")
    page.page.wait_for_selector('.parking .state:text-is("Waits: no goal yet")')
    return page


def test_a_car_is_sent_to_a_place_that_is_clicked(visited: Visit, agent: AgentStub) -> None:
    page, place = visited.page, next(iter(ROADS.city_map.spawns)).name
    page.click('button:text-is("Park here")')
    page.wait_for_selector(".chip.hint")
    judge(visited)
    middle = ROADS.spawn_pose(place) @ Pose2(0.08, 0.0, 0.0)
    click_on(page, middle.x, middle.y)
    page.click(f'.chip:text-is("Park n2 at {place}")')
    page.wait_for_selector('.parking .state:has-text("Stands: something stands in the way")')
    page.wait_for_selector('.parking dd:has-text("±12 mm, 0.6°")')
    assert (agent.goals, page.locator(".chip.hint").count()) == ([place], 0)
    judge(visited)
    page.click('button:text-is("Costmap")')
    page.wait_for_selector('.costmap-key:has-text("9 cm")')
    page.click('button:text-is("Costmap")')
    page.wait_for_selector(".costmap-key", state="detached")
    for _ in in_both_themes(visited, "light"):
        is_drawn(page, GOAL, 50)
        is_drawn(page, PATH, 100)
        is_drawn(page, PARTICLE, 4)


def test_a_drag_on_the_floor_gives_the_heading(visited: Visit, agent: AgentStub) -> None:
    page = visited.page
    page.click('button:text-is("Park here")')
    x, y = pixel_of(page, 1.384, 1.3)  # between the loops
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 80, steps=3)
    page.mouse.up()
    page.click('.chip:text-is("Park n2 there")')
    page.wait_for_selector('.parking dd:has-text("90°")')
    x_m, y_m, deg = map(float, agent.goals[0].split(","))
    assert (x_m, y_m, deg) == pytest.approx((1.384, 1.22, 90.0), abs=0.02)
    assert page.locator('[aria-label="Show all"]').is_disabled()  # the drag moved no map


def test_a_goal_is_given_by_keyboard(visited: Visit) -> None:
    page = visited.page
    page.focus('button:text-is("Park here")')
    page.keyboard.press("Enter")
    page.wait_for_selector(".chip.hint")
    page.keyboard.press("Escape")
    page.wait_for_selector(".chip.hint", state="detached")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.wait_for_selector("dialog[open] [name=goal]:focus")
    judge(visited, "dialog")
    page.keyboard.type("1.384,1.0,45")
    page.keyboard.press("Enter")
    page.wait_for_selector('.notice:has-text("n2 parks at 1.38, 1.00 m.")')


def test_the_vehicle_page_says_it_too(agent: AgentStub, visit: Callable[..., Visit]) -> None:
    page = visit("/vehicles/n2").page
    page.wait_for_selector('[data-fact="parking"]:text-is("Waits: no goal yet")')
    agent.status = AutonomyStatus(vehicle="n2", t_ns=1, state="parked")
    page.wait_for_selector('[data-fact="parking"]:text-is("Parked")')


def test_the_map_that_a_car_makes_is_shown_beside_it_and_where_it_is(
    running: Town, visit: Callable[..., Visit]
) -> None:
    with running.joined(MapStub()):
        visited = visit("/map?vehicle=n2")
        page = visited.page
        page.wait_for_selector('.mapping .state:text-is("Builds a map: goes on 0.9 m to see more")')
        page.wait_for_selector('.mapping dd:has-text("0.08 m² in 0.4")')
        assert page.locator('button:text-is("Park here")').count() == 0
        is_drawn(page, WALL, 100)
        judge(visited)
        page.click('button:text-is("Map")')
        page.wait_for_selector('[aria-label="Maps that cars make"]', state="detached")
