"""The route driver on the driving school, with a bicycle whose servo and motor take their time."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.geometry import Pose2, wrap_angle
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import spatem_of
from scm.v2x.messages.spat import Spat
from scm.vehicles.driver import CarLimits, Other, RouteView
from scm.vehicles.drivers.signal_table import SignalTable
from tests.unit.vehicles.drivers.route_driver import RouteDriver

NIGEL = CarLimits(
    wheelbase=0.14154,
    steer_limit=0.5235988,
    steer_rate=0.42,
    front=0.23,
    rear=0.07,
    width=0.175,
    speeds=(
        0.02867, 0.05685, 0.08457, 0.11185, 0.13871, 0.16516, 0.19122, 0.21688, 0.24215, 0.26703,
    ),
)  # fmt: skip
TICK_NS = 20 * NS_PER_MS
NEVER_NS = 10**15


@pytest.fixture(scope="module")
def city_map():
    return load_map("driving_school")


@pytest.fixture(scope="module")
def eight(city_map):
    return Path.circulation(Roads(city_map), "east_loop")


@dataclass
class Bicycle:
    """Kinematic bicycle: servo of limited rate, speed lag 60 ms, understeer of 5 percent."""

    pose: Pose2
    speed: float = 0.0
    angle: float = 0.0
    understeer: float = 0.95

    def advance(self, throttle, steering, dt=0.02, substeps=4):
        table = (0.0, *NIGEL.speeds)
        wanted = float(np.interp(abs(throttle), np.linspace(0, 1, 11), table))
        wanted = math.copysign(wanted, throttle) if throttle else 0.0
        for _ in range(substeps):
            h = dt / substeps
            step = NIGEL.steer_rate * h
            self.angle += max(-step, min(step, steering * NIGEL.steer_limit - self.angle))
            self.speed += (wanted - self.speed) * (1.0 - math.exp(-h / 0.06))
            x, y, yaw = self.pose
            rate = self.speed * math.tan(self.angle) / NIGEL.wheelbase * self.understeer
            self.pose = Pose2(
                x + self.speed * math.cos(yaw) * h,
                y + self.speed * math.sin(yaw) * h,
                wrap_angle(yaw + rate * h),
            )


@dataclass
class Scene:
    """One car with its driver, and the signals it is told."""

    city_map: object
    path: Path
    car: Bicycle
    driver: RouteDriver
    signals: SignalTable
    now_ns: int = 0
    colour: str = "green"
    others: tuple = ()
    stop: bool = False
    silent: bool = False
    min_end_ns: int | None = None
    trace: list = field(default_factory=list)

    def run(self, duration_s):
        for _ in range(round(duration_s / 0.02)):
            self.tick()
        return self

    def tick(self):
        self.now_ns += TICK_NS
        if not self.silent:
            self.tell()
        view = RouteView(
            self.now_ns, self.car.pose, self.car.speed, self.signals, self.others, self.stop
        )
        throttle, steering = self.driver.decide(view)
        self.car.advance(throttle, steering)
        self.trace.append((self.driver.s, self.driver.cross_track, self.car.speed))

    def tell(self):
        junction = self.city_map.junctions[0]
        end_ns = self.now_ns + 10**9 if self.min_end_ns is None else self.min_end_ns
        groups = tuple(
            SignalGroup(group=g.name, colour=self.colour, since_ns=0, min_end_ns=end_ns)
            for g in junction.groups
        )
        spat = Spat(
            junction=junction.name, t_ns=self.now_ns, seq=1, mode="plan", plan="p", groups=groups
        )
        self.signals.receive_spatem(spatem_of(spat, junction), self.now_ns)

    @property
    def bumper_before_line(self):
        """Distance from the front bumper to the stop line it last came near to [m], + = before."""
        front = self.driver.s + NIGEL.front
        lines = [at + k * self.path.length_m for at, _ in self.path.stop_lines for k in range(3)]
        return min((at - front for at in lines), key=abs)


@pytest.fixture
def scene(city_map, eight):
    def make(s=0.5, *, path=eight, lateral=0.0, yaw=0.0, **options):
        at = path.at(s)
        pose = at @ Pose2(0.0, lateral, yaw)
        driver = RouteDriver(path, NIGEL, **options)
        return Scene(city_map, path, Bicycle(pose), driver, SignalTable(city_map))

    return make


def other_at(path, s, speed=0.0, lateral=0.0):
    """Return a car whose rear bumper is at s on the path."""
    x, y, yaw = path.at(s + 0.15) @ Pose2(0.0, lateral, 0.0)
    return Other(x, y, yaw, speed, 0.30, 0.175)


def test_a_lap_of_the_eight_is_driven_within_five_millimetres_of_its_line(scene):
    run = scene().run(60.0)
    assert run.driver.done_m > run.path.length_m
    settled = run.trace[150:]
    assert max(abs(lateral) for _, lateral, _ in settled) < 0.005
    assert max(abs(lateral) for _, lateral, _ in run.trace) < 0.02


@pytest.mark.parametrize(("lateral", "yaw"), [(0.06, 0.2), (-0.06, -0.2), (0.1, -0.8)])
def test_a_car_pushed_aside_comes_back_to_its_line_and_stays(scene, lateral, yaw):
    run = scene(lateral=lateral, yaw=yaw).run(10.0)
    assert max(abs(beside) for _, beside, _ in run.trace[350:]) < 0.005


def test_the_bumper_stops_two_to_six_centimetres_before_a_red_line(scene):
    run = scene()
    run.colour = "red"
    run.run(25.0)
    assert run.car.speed == pytest.approx(0.0, abs=1e-3)
    assert 0.02 <= run.bumper_before_line <= 0.06
    assert run.driver.waiting_for == "signal"


def test_flashing_red_is_a_stop_sign(scene):
    run = scene()
    run.colour = "flashing_red"
    rested = False
    for _ in range(150):
        run.run(0.2)
        rested = rested or (run.car.speed < 0.005 and 0.02 <= run.bumper_before_line <= 0.06)
        if run.bumper_before_line < 0.0:
            break
    assert rested
    assert run.bumper_before_line < 0.0


@pytest.mark.parametrize("colour", ["dark", "red"])
def test_a_car_that_waits_does_not_go_on(scene, colour):
    run = scene()
    run.colour = colour
    at = run.run(25.0).driver.s
    assert run.run(5.0).driver.s == pytest.approx(at, abs=1e-3)


def test_silence_of_the_signals_stops_the_car_at_the_line(scene):
    run = scene()
    run.silent = True
    run.run(25.0)
    assert 0.02 <= run.bumper_before_line <= 0.06


def test_a_waiting_car_goes_on_green(scene):
    run = scene()
    run.colour = "red"
    at = run.run(25.0).driver.s
    run.colour = "green"
    assert run.run(4.0).driver.s > at + 0.5


@pytest.mark.parametrize("distance_m", [0.01 * k for k in range(1, 31)])
def test_no_car_passes_the_line_on_red_wherever_it_is_at_yellow(scene, eight, distance_m):
    """0.56 s of yellow is what 0.26 m/s, 0.3 s of reaction and 0.5 m/s^2 ask for."""
    run = scene(s=1.2)
    line = next(at for at, _ in eight.stop_lines if at > 1.6)
    run.tick()
    while line - (run.driver.s + NIGEL.front) > distance_m:
        run.tick()
    run.colour, run.min_end_ns = "yellow", run.now_ns + 560 * NS_PER_MS
    run.run(0.56)
    run.colour, run.min_end_ns = "red", None
    was_before = run.driver.s + NIGEL.front <= line
    run.run(3.0)
    assert was_before == (run.driver.s + NIGEL.front <= line)


def test_a_standing_car_is_not_touched(scene, eight):
    run = scene()
    run.others = (other_at(eight, 2.0),)
    run.run(12.0)
    gap = 2.0 - (run.driver.s + NIGEL.front)
    assert 0.05 <= gap <= 0.15
    assert run.driver.waiting_for == "vehicle"


def test_a_slow_car_is_followed_with_a_time_gap(scene, eight):
    run = scene()
    for tick in range(600):
        run.others = (other_at(eight, 1.3 + 0.1 * 0.02 * tick, speed=0.1),)
        run.tick()
    gap = 1.3 + 0.1 * 0.02 * 599 - (run.driver.s + NIGEL.front)
    assert gap == pytest.approx(0.08 + 0.8 * 0.1, abs=0.03)
    assert run.car.speed == pytest.approx(0.1, abs=0.01)


def test_a_car_beside_the_lane_does_not_hold_anybody(scene, eight):
    run = scene()
    run.others = (other_at(eight, 1.5, lateral=0.25),)
    assert run.run(10.0).driver.done_m > 1.5


def test_the_junction_is_not_entered_while_its_exit_is_blocked(scene, eight):
    run = scene(s=1.2)
    start, end, _ = next(c for c in eight.conflicts if c[0] > 1.6)
    run.others = (other_at(eight, end + 0.2),)
    run.run(15.0)
    assert run.driver.s + NIGEL.front < start
    assert run.driver.waiting_for == "vehicle"


def test_the_junction_is_entered_when_its_exit_has_room(scene, eight):
    run = scene(s=1.2)
    _, end, _ = next(c for c in eight.conflicts if c[0] > 1.6)
    run.others = (other_at(eight, end + 0.40),)
    run.run(15.0)
    assert run.driver.s >= end - 0.01


def test_an_open_route_ends_with_the_rear_axle_at_its_end(scene, city_map):
    path = Path(Roads(city_map), ("east_loop",))
    run = scene(s=1.0, path=path).run(10.0)
    assert run.driver.arrived
    assert run.driver.s == pytest.approx(path.length_m, abs=0.02)
    assert run.driver.trip_m == pytest.approx(path.length_m - 1.0, abs=0.01)


def test_a_route_under_way_has_not_arrived(scene, city_map):
    run = scene(s=0.5, path=Path(Roads(city_map), ("east_loop",))).run(1.0)
    assert not run.driver.arrived
    assert 0.0 < run.driver.done_m < 0.5


def test_an_order_to_stop_brings_the_car_to_rest_where_it_is(scene):
    run = scene().run(3.0)
    at, run.stop = run.driver.s, True
    run.run(1.0)
    assert run.car.speed == pytest.approx(0.0, abs=0.02)
    assert run.driver.s - at < 0.1
    assert run.driver.waiting_for == "stop"


def test_a_target_speed_is_kept(scene):
    assert scene(speed=0.12).run(5.0).car.speed == pytest.approx(0.12, abs=0.005)


def test_mirrored_errors_are_steered_with_mirrored_commands(scene, city_map):
    path = Path(Roads(city_map), ("crossing_south_east",))
    left, right = scene(s=0.7, path=path, lateral=0.02), scene(s=0.7, path=path, lateral=-0.02)
    a = left.driver.decide(RouteView(1, left.car.pose, 0.1, left.signals))[1]
    b = right.driver.decide(RouteView(1, right.car.pose, 0.1, right.signals))[1]
    assert a < 0.0
    assert a == pytest.approx(-b, abs=1e-6)
