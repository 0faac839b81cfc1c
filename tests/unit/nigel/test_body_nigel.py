"""A real car's body: where the Eye saw it, when it must not move, what its wheels are told."""

import math
from dataclasses import replace

import msgspec
import pytest

from scm.clock import NS_PER_MS
from scm.errors import RunError
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.maps.route import Roads
from scm.v2x.message import Refused
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import Quantity, load_car
from scm.vehicles.lights import Switches
from tests.unit.vehicle_agent.test_agent import EPOCH, Desk, command, lease, one, welcome
from vehicle_agent.bodies import nigel
from vehicle_agent.bodies.nigel import BODY, LIFTED_M, MAX_TRACK_AGE_NS, NigelBody
from vehicle_agent.body import Obeyed, Wiring
from vehicle_agent.nigel.host import REST, NigelCommand
from vehicle_agent.nigel.serial_watchdog import WatchdogReport, Written
from vehicle_agent.nigel.telemetry import Telemetry

BEGIN_NS = 10**9
SURE = tuple(tuple(1e-6 * (row == column) for column in range(6)) for row in range(6))


class FakeWatchdogClient:
    """Takes wishes."""

    def __init__(self):
        self.wishes, self.fault, self.report, self.is_closed = [], "", None, False

    def trouble(self, now_ns):
        return self.fault

    def command(self, wish, now_ns):
        self.wishes.append(wish)

    def written(self):
        return [Written(BEGIN_NS, 0.3, -0.2)]

    def close(self):
        self.is_closed = True


def track(t_ns=BEGIN_NS, x=1.0, y=0.5, yaw=0.0, **more):
    known = {"speed_mps": 0.0, "lateral_speed_mps": 0.0, "yaw_rate_radps": 0.0, "age_s": 0.02}
    return EyeTrack(vehicle="n7", tag_id=1, t_ns=t_ns, x_m=x, y_m=y, yaw_rad=yaw, covariance=SURE,
                    stale=False, **{**known, **more})  # fmt: skip


def calibrated(**numbers):
    car = load_car("nigel")
    given = {key.replace("_", ".", 1): Quantity(value, None, "1", "calibration")
             for key, value in numbers.items()}  # fmt: skip
    return replace(car, values={**car.values, **given})


@pytest.fixture
def body():
    made = NigelBody(calibrated(drive_deadband=0.2), FakeWatchdogClient())
    made.place(Pose2(0.3, 0.3, 0.0), BEGIN_NS)
    made.see(track(), BEGIN_NS)
    made.was_lifted()
    made.advance(BEGIN_NS)
    return made


def rests(wish):
    return (wish.throttle, wish.steering) == (0.0, 0.0)


def newest(body):
    return body._watchdog.wishes[-1]


def test_a_seen_pose_is_carried_forward_on_its_arc(body):
    body.see(track(BEGIN_NS + 1, speed_mps=0.2, yaw_rate_radps=0.5), BEGIN_NS)
    body.advance(BEGIN_NS + 200 * NS_PER_MS)
    radius, turned = 0.4, 0.1
    assert body.motion().pose == pytest.approx(
        (1.0 + radius * math.sin(turned), 0.5 + radius * (1.0 - math.cos(turned)), turned), abs=1e-4
    )
    body.advance(BEGIN_NS + 10**10)
    assert body.motion().pose.x < 1.0 + 0.2 * MAX_TRACK_AGE_NS / 1e9 + 1e-9


def test_the_charge_of_a_real_battery_is_estimated_from_its_voltage(body):
    told = WatchdogReport(
        phase="ready", trouble="", opened=1, readings=1, battery_v=None, telemetry=None
    )
    body._watchdog.report = told
    assert (body.motion().battery_v, body.motion().battery_charge) == (None, None)
    body._watchdog.report = msgspec.structs.replace(told, battery_v=3 * 3.84 - 0.03 * 0.8)
    assert body.motion().battery_charge == pytest.approx(0.5, abs=1e-6), "0.8 A through 0.03 ohm"
    body.command(1.0, 0.0)
    assert body.motion().battery_charge > 0.54, "motors that still stand draw 3 A and more"


def test_before_the_eye_has_seen_it_it_stands_where_the_city_put_it():
    body = NigelBody(calibrated(drive_deadband=0.2), FakeWatchdogClient())
    body.place(Pose2(0.3, 0.4, 0.5), BEGIN_NS)
    assert body.motion().pose == (0.3, 0.4, 0.5)
    assert body.inhibit_reason(BEGIN_NS) == "the Eye has not seen it yet"
    body.command(1.0, 1.0)
    assert rests(newest(body))


@pytest.mark.parametrize(
    ("seen", "late_ms", "words"),
    [
        (track(BEGIN_NS + 1), 0, ""),
        (track(BEGIN_NS + 1), 220, ""),
        (track(BEGIN_NS + 1), 240, "the Eye has not seen it for 0.3 s"),
        (track(BEGIN_NS + 1, age_s=0.31), 0, "the Eye has not seen it for 0.3 s"),
        (msgspec.structs.replace(track(BEGIN_NS + 1), stale=True), 0, "the Eye has not seen it"),
    ],
)
def test_an_old_or_stale_pose_keeps_it_from_moving(body, seen, late_ms, words):
    body.see(seen, BEGIN_NS)
    now_ns = BEGIN_NS + late_ms * NS_PER_MS
    body.advance(now_ns)
    body.command(0.5, 0.5)
    assert body.inhibit_reason(now_ns).startswith(words)
    assert bool(body.inhibit_reason(now_ns)) == bool(words)
    assert rests(newest(body)) == bool(words)


def test_tracks_that_are_older_or_no_numbers_change_nothing(body):
    before = body.motion()
    body.see(track(BEGIN_NS - 1, x=1.1), BEGIN_NS)
    body.see(track(BEGIN_NS + 9, x=math.nan), BEGIN_NS)
    body.see(track(BEGIN_NS + 9, speed_mps=math.inf), BEGIN_NS)
    assert body.motion() == before


def test_a_car_that_was_carried_away_is_noticed_once(body):
    body.see(track(BEGIN_NS + 1, x=1.0 + 0.9 * LIFTED_M), BEGIN_NS)
    assert not body.was_lifted()
    body.see(track(BEGIN_NS + 2, x=1.0 + 2.0 * LIFTED_M), BEGIN_NS)
    assert body.was_lifted()
    assert not body.was_lifted()


def test_trouble_with_the_cable_comes_first(body):
    body._watchdog.fault = "/dev/x: unplugged"
    body.command(0.5, 0.5)
    assert body.inhibit_reason(BEGIN_NS) == "/dev/x: unplugged"
    assert rests(newest(body))


@pytest.mark.parametrize(("wished", "given"), [(0.0, 0.0), (0.1, 0.3), (-0.1, -0.3), (1.0, 1.2)])
def test_the_cars_own_deadband_is_undone(body, wished, given):
    body.command(wished, 0.25)
    assert newest(body) == NigelCommand(pytest.approx(given), 0.25, 0)


def test_gains_and_trim_are_undone():
    car = calibrated(drive_gain=0.5, steering_gain=0.8, steering_trim_rad=0.1)
    body = NigelBody(car, FakeWatchdogClient())
    body.see(track(), BEGIN_NS)
    body.advance(BEGIN_NS)
    body.command(0.2, 0.4)
    assert newest(body).throttle == pytest.approx(0.4)
    angle = 0.8 * newest(body).steering * body.limits.steer_limit + 0.1
    assert angle == pytest.approx(0.4 * body.limits.steer_limit)


def test_without_a_calibration_nothing_is_added():
    body = NigelBody(load_car("nigel"), FakeWatchdogClient())
    body.see(track(), BEGIN_NS)
    body.advance(BEGIN_NS)
    body.command(0.1, 0.0)
    assert newest(body).throttle == 0.1


def test_it_tells_its_acceleration_from_its_speeds(body):
    for step in range(1, 41):
        seen = track(BEGIN_NS + 50 * step * NS_PER_MS, speed_mps=0.01 * step)
        body.see(seen, seen.t_ns)
    assert body.motion().accel == pytest.approx(0.2, rel=0.01)
    body.see(msgspec.structs.replace(seen, t_ns=seen.t_ns + 1, stale=True), seen.t_ns)
    assert body.motion().accel == 0.0


def test_wheels_turn_as_fast_as_the_servo(body):
    body.command(0.1, 1.0)
    body.advance(BEGIN_NS + 100 * NS_PER_MS)
    assert body.motion().steering == pytest.approx(0.1 * body.limits.steer_rate)


@pytest.mark.parametrize(
    ("switches", "bits"),
    [(Switches("off", "off"), 0), (Switches("low", "left"), 5), (Switches("high", "right"), 11),
     (Switches("off", "hazard"), 12)],
)  # fmt: skip
def test_lamps_are_bits(body, switches, bits):
    body.show(switches)
    body.command(0.0, 0.0)
    assert newest(body).lamps == bits


def told(readings, gyro=0.5):
    reading = Telemetry(10, -20, gyro, (1.0, 2.0), 11.1, 1.0, 5.0)
    return WatchdogReport("ready", "", 1, readings, 11.1, reading)


def test_telemetry_becomes_sensors_once_each(body):
    assert body.sensors("n7", 5) == []
    body._watchdog.report = told(1)
    (message,) = body.sensors("n7", 5)
    assert (message.encoder_left, message.encoder_right, message.t_ns) == (10, -20, 5)
    assert message.gyro_radps == (0.0, 0.0, 0.5)
    assert message.accel_mps2[:2] == (1.0, 2.0)
    assert body.sensors("n7", 6) == []
    body._watchdog.report = told(2, gyro=math.nan)
    assert body.sensors("n7", 7) == []


def test_a_real_body_needs_a_port():
    with pytest.raises(RunError, match="no serial port given"):
        BODY.open("nigel", 0, Wiring())


class RealDesk(Desk):
    """A real car's agent, an Eye and a city played by hand."""

    def __init__(self, city_map, spawn, monkeypatch):
        self.watchdog = FakeWatchdogClient()
        monkeypatch.setattr(nigel, "WatchdogClient", lambda path, baud: self.watchdog)
        super().__init__(city_map, spawn, body="nigel", wiring=Wiring(port="x"))
        self.at, self.sees, self.state = spawn, True, None

    def see_for(self, span_s, *messages):
        for _ in range(round(span_s / 0.02)):
            self.now_ns += 1
            seen = [track(self.now_ns, *self.at)] if self.sees else []
            sent = self.step(*seen, *messages)
            self.state = one(sent, VehicleState) or self.state
            self.status = one(sent, PartStatus) or getattr(self, "status", None)
        return self.watchdog.wishes[-1]


@pytest.fixture
def desk(monkeypatch):
    city_map = load_map("driving_school")
    made = RealDesk(city_map, Roads(city_map).spawn_pose("a"), monkeypatch)
    made.step(WorldDefinition(t_ns=1, seed=0, map=city_map))
    assert made.asked[0].request.kind == "real"
    made.step(replies=[(made.asked[0], welcome(made.spawn))])
    return made


def test_it_joins_as_a_real_car_and_drives_where_the_eye_sees_it(desk):
    assert desk.see_for(2.0).throttle > 0.05
    assert (desk.state.source, desk.state.mode) == ("eye", "drive")
    assert (desk.state.x_m, desk.state.y_m) == pytest.approx(desk.spawn[:2], abs=1e-3)


def test_it_rests_before_it_is_in_the_city_and_at_the_end(desk, monkeypatch):
    outside = RealDesk(desk.map, desk.spawn, monkeypatch)
    outside.step()
    assert outside.watchdog.wishes == [REST]
    desk.see_for(2.0)
    desk.part.finish(desk.now_ns)
    assert desk.watchdog.wishes[-1].throttle == 0.0
    desk.part.close()
    assert desk.watchdog.is_closed


def test_zeros_within_280_ms_once_the_eye_is_blind(desk):
    desk.see_for(2.0)
    desk.sees = False
    assert desk.see_for(0.20).throttle > 0.05
    assert rests(desk.see_for(0.06))
    assert desk.state.mode == "stop"
    desk.see_for(1.0)
    assert desk.status.detail.startswith("the Eye has not seen it for")


def test_zero_throttle_at_once_on_a_city_stop(desk):
    desk.see_for(2.0)
    assert desk.see_for(0.02, CityStop(t_ns=1, engaged=True, by="x")).throttle == 0.0


def test_zero_throttle_within_150_ms_once_the_lease_is_lost(desk):
    desk.see_for(2.0)
    desk.answers_renewals = False
    desk.part._link.give_way()
    assert desk.see_for(0.18).throttle == 0.0


def test_zero_throttle_at_once_when_a_renewal_is_refused(desk):
    desk.see_for(2.0)
    desk.answers_renewals = False
    while not desk.asked:
        assert desk.see_for(0.02).throttle > 0.05
    refused = Refused(code="owned", detail="ann has it")
    desk.step(track(desk.now_ns + 1, *desk.at), replies=[(desk.asked[0], refused)])
    assert desk.watchdog.wishes[-1].throttle == 0.0
    desk.step(track(desk.now_ns + 1, *desk.at), command(EPOCH + 1, throttle=0.3))
    assert desk.watchdog.wishes[-1].throttle > 0.05


def test_zeros_within_280_ms_once_the_bus_is_broken_and_it_drives_when_it_is_back(desk):
    desk.see_for(2.0)
    desk.sees = desk.answers_renewals = False
    assert desk.see_for(0.20).throttle > 0.05
    assert rests(desk.see_for(0.06))
    assert rests(desk.see_for(2.0))
    desk.sees = desk.answers_renewals = True
    while not desk.asked:
        desk.see_for(0.02)
    assert desk.asked[0].request.verb == "acquire"
    granted = [(desk.asked[0], lease(EPOCH + 1))]
    desk.step(track(desk.now_ns + 1, *desk.at), replies=granted)
    assert desk.see_for(2.0).throttle > 0.05


def test_a_step_that_raises_lets_go_of_the_cable_before_anybody_is_told(desk, monkeypatch):
    desk.see_for(2.0)

    def fails(now_ns, epoch, **_):
        raise ZeroDivisionError

    monkeypatch.setattr(desk.part._session, "step", fails)
    with pytest.raises(ZeroDivisionError):
        desk.step()
    assert desk.watchdog.is_closed


def test_zeros_when_the_city_forgets_the_car(desk):
    desk.see_for(2.0)
    desk.part._link.leave("test")
    assert rests(desk.see_for(0.04))


def test_a_car_put_beside_the_lanes_stands_until_it_is_put_on_one(desk):
    desk.see_for(2.0)
    desk.at = Pose2(1.384 + 0.728, 0.655, 0.0)
    assert desk.see_for(1.0).throttle == 0.0
    assert desk.part._session.trips.off_lane
    desk.at = desk.spawn
    assert desk.see_for(2.0).throttle > 0.05


def test_its_fence_stops_it(desk, monkeypatch):
    fenced = RealDesk(desk.map, desk.spawn, monkeypatch)
    x, y, _ = desk.spawn
    corners = ((x - 9, y - 9), (x - 8, y - 9), (x - 8, y - 8), (x - 9, y - 8))
    fenced.part._wiring = Wiring(port="x", fence=corners)
    fenced.step(WorldDefinition(t_ns=1, seed=0, map=desk.map))
    fenced.step(replies=[(fenced.asked[0], welcome(fenced.spawn))])
    assert fenced.see_for(2.0).throttle == 0.0
    assert fenced.state.mode == "stop"
    assert "fence" in fenced.status.detail


def test_what_it_obeyed_is_what_the_keeper_of_its_cable_wrote():
    body = NigelBody(load_car("nigel"), FakeWatchdogClient())
    body.command(0.9, 0.9)
    assert body.obeyed() == [Obeyed(BEGIN_NS, 0.3, -0.2)]
