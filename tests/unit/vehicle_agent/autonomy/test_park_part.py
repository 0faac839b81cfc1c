import itertools

import numpy as np
import pytest

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RunError
from scm.eye.part import EyePart
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.message import Refused
from scm.v2x.messages.autonomy_plan import AutonomyPlan
from scm.v2x.messages.autonomy_status import AutonomyStatus
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.lease_request import LeaseReply, LeaseRequest
from scm.v2x.messages.park_request import ParkReply, ParkRequest
from scm.world.part import WorldPart
from vehicle_agent.agent import AgentPart
from vehicle_agent.autonomy.part import ParkPart, Wanted
from vehicle_agent.autonomy.shown import SHOWN

SCHOOL, OBSTACLES = load_map("parking_school"), load_map("parking_school_obstacles")


def drive(wanted, lasts_s, seed=1):
    """Run a city with a parking agent; return its part, commands, statuses and plans."""
    part, kinds = ParkPart("park-n1", wanted, "s"), (DriveCommand, AutonomyStatus, AutonomyPlan)
    with Lockstep([WorldPart(OBSTACLES, seed, ()), part]) as city:
        boxes = [city.subscribe(Subscription(kind, {"vehicle": "n1"})) for kind in kinds]
        city.run_for(lasts_s)
        return part, *([item.message for item in box.drain()] for box in boxes)


def ask(city, goal):
    return city.call(ParkRequest(vehicle="n1", goal=goal))


def test_car_parks_on_request_and_gives_its_lease_back():
    part = ParkPart("park-n1", Wanted("n1", spawn="a"))
    take = LeaseRequest(vehicle="n1", owner="script", verb="acquire", ttl_ms=1000)
    with Lockstep([WorldPart(OBSTACLES, 1, ()), part]) as city:
        city.run_for(1.0)
        assert part.parking is None
        reply = ask(city, "-0.3,0.0,0")
        assert isinstance(reply, ParkReply)
        assert (reply.x_m, reply.y_m, reply.yaw_rad) == (-0.3, 0.0, 0.0)
        city.run_for(1.0)
        assert isinstance(city.call(take), Refused)
        city.run_until(lambda: part.is_over, 30.0)
        city.run_for(0.5)
        assert isinstance(city.call(take), LeaseReply)
        assert part.parking.report.state == "parked"


@pytest.mark.parametrize("goal", ["nowhere", "9.0,0.0,0"])
def test_goal_that_the_map_has_not_is_refused_and_the_old_one_stays(goal):
    part = ParkPart("park-n1", Wanted("n1", "goal", spawn="start"))
    with Lockstep([WorldPart(OBSTACLES, 1, ()), part]) as city:
        city.run_for(1.0)
        before = part.parking.goal
        reply = ask(city, goal)
        assert isinstance(reply, Refused)
        assert reply.code == "invalid"
        assert goal.split(",")[0].rstrip("0.") in reply.detail
        assert part.parking.goal == before


def test_request_before_there_is_a_map_is_refused():
    part = ParkPart("park-n1", Wanted("n1"))
    with Lockstep([part]) as city:
        city.run_for(0.1)
        assert ask(city, "goal").code == "offline"


def test_spawn_that_is_refused_ends_the_agent_with_its_reason():
    part = ParkPart("park-n1", Wanted("n1", "goal", spawn="nowhere"))
    with Lockstep([WorldPart(OBSTACLES, 1, ()), part]) as city, pytest.raises(
        RunError, match="nowhere"
    ):  # fmt: skip
        city.run_for(1.0)


def test_status_and_plan_say_where_the_car_is_and_goes():
    part, _, statuses, plans = drive(Wanted("n1", "goal", spawn="start"), 3.0)
    last, plan = statuses[-1], plans[-1]
    assert last.state == "drive"
    assert last.x_m == pytest.approx(part.parking.perception.now().pose.x, abs=0.1)
    assert last.position_std_m < 0.05
    assert last.explained > 0.9
    assert last.attempts == 1
    np.testing.assert_allclose(plan.path[-1], (0.75, 0.0, 0.0), atol=1e-3)
    assert 2 <= len(plan.trajectory) <= SHOWN
    assert 2 <= len(plan.particles) <= SHOWN
    assert 10 <= len(statuses) <= 20
    later_ns = plan.t_ns + 2 * NS_PER_S
    part.attach(lambda kind, where: False)
    assert not any(isinstance(item, Costmap) for item in part.step(later_ns, []))
    part.attach(lambda kind, where: (kind, where) == (Costmap, {"vehicle": "n1"}))
    sent = [
        [item for item in part.step(later_ns + t_ns, []) if isinstance(item, Costmap)]
        for t_ns in (NS_PER_MS, 2 * NS_PER_MS)
    ]
    assert list(map(len, sent)) == [1, 0]
    cells = np.frombuffer(sent[0][0].cells, np.uint8)
    assert (cells.min(), cells.max() > 30) == (0, True)


def test_published_stack_plans_over_cells_forward_only_and_commands_at_5_hz():
    wanted = Wanted("n1", "goal", spawn="start", stack="published")
    _, commands, _, plans = drive(wanted, 3.0)
    inner = np.array(plans[-1].path)[1:-1]
    cells = (inner[:, 0] - inner[0, 0]) / 0.05
    np.testing.assert_allclose(cells, cells.round(), atol=0.01)
    changes = [
        after.t_ns for before, after in itertools.pairwise(commands)
        if (before.throttle, before.steering) != (after.throttle, after.steering)
    ]  # fmt: skip
    assert len(changes) > 5
    assert min(np.diff(changes)) >= 0.2 * NS_PER_S


def test_stack_that_does_not_exist_is_refused():
    with pytest.raises(RunError, match="expected one of own, mppi, published, got 'teb'"):
        ParkPart("park-n1", Wanted("n1", stack="teb"))


def test_same_seed_gives_equal_bits():
    runs = [drive(Wanted("n1", "goal", spawn="start", seed=3), 1.5)[1] for _ in range(2)]
    assert len(runs[0]) > 20
    assert runs[0] == runs[1]
    assert any(command.throttle for command in runs[0])


def test_eye_says_where_a_car_is_in_a_room_that_looks_the_same_from_two_places():
    part, world = ParkPart("park-n1", Wanted("n1", "goal", use_eye=True)), WorldPart(SCHOOL, 1, ())
    with Lockstep([world, part, EyePart(SCHOOL, seed=1)]) as city:
        car = world.world.host("n1", "nigel", roads_of(SCHOOL).spawn_pose("d"), 0)
        city.run_for(0.8)
        here = part.parking.perception.now()
        assert here.is_known
        assert np.hypot(*(car.pose.inverse() @ here.pose)[:2]) < 0.02
        assert part.parking.report.state == "drive"


def test_car_with_an_agent_of_its_own_parks_where_there_are_no_lanes():
    part = ParkPart("park-n1", Wanted("n1", "0.3,0.0,0", start="a"))
    parts = [WorldPart(OBSTACLES, 1, ()), AgentPart("n1", spawn="a"), part]
    with Lockstep(parts) as city:
        city.run_until(lambda: part.is_over, 30.0)
    assert part.parking.report.state == "parked"
