"""What the world does unasked: radio, signals, sensors, contacts, lights, its own pace."""

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S
from scm.geometry import Pose2
from scm.maps.load import load_map
from scm.records.signals import SignalGroup
from scm.v2x.etsi.convert import roadside_station, spatem_of
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.drive_command import DriveCommand
from scm.v2x.messages.join_request import JoinRequest
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.spatem import SpatemTx
from scm.v2x.messages.spawn_request import SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.world_definition import WorldDefinition
from scm.v2x.messages.world_snapshot import WorldSnapshot
from scm.world.part import WorldPart

MAP = load_map("driving_school")


def test_commands_for_a_car_that_nobody_leased_are_counted_as_ignored(city):
    city.ask(SpawnRequest(vehicle="n1"))
    epoch = city.world.cars.hosted["n1"].lease.epoch
    city.run(1, DriveCommand(vehicle="n1", t_ns=0, epoch=epoch, seq=1, throttle=1.0, steering=0.0))
    assert city.world.ignored == 1


def test_the_red_button_stops_a_leased_car_too(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    lease = city.lease()
    city.ask(StopRequest(engaged=True, by="bob"))
    for seq in range(30):
        city.run(1, city.command(lease, seq))
    assert city.shown("n1").mode == "stop"
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-6)


def test_a_lost_commanders_car_flashes_both_indicators(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.lease()
    city.run_for(3.0)
    shown = [
        vehicle.lights for shot in city.heard(WorldSnapshot)[-30:] for vehicle in shot.vehicles
    ]
    flashing = [{"left", "right"} <= set(lights) for lights in shown]
    assert any(flashing)
    assert not all(flashing)


def test_the_radio_carries_a_hosted_cars_own_frame_only_once(city):
    city.ask(SpawnRequest(vehicle="n1"))
    city.run_for(1.0)
    own = city.heard(CamTx)
    before = city.world.radio.link.counts.sent
    city.run(1, own[-1])
    assert city.world.radio.link.counts.sent == before == len(own)


def test_agents_in_range_receive_what_hosted_cars_send(city):
    city.join()
    city.ask(SpawnRequest(vehicle="n1"))
    city.run_for(0.5)
    received = city.heard(CamRx)
    assert {(cam.receiver, cam.station) for cam in received} >= {("n7", "n1")}


def green(city):
    """Return a SPATEM in which every group of the only junction may go."""
    junction = MAP.junctions[0]
    groups = tuple(
        SignalGroup(group=g.name, colour="green", since_ns=0, min_end_ns=city.now + 10 * NS_PER_S)
        for g in junction.groups
    )
    spat = Spat(
        junction=junction.name, t_ns=city.now, seq=1, mode="plan", plan="calm", groups=groups,
        revision=MAP.revision,
    )  # fmt: skip
    body = spatem_of(spat, junction)
    return SpatemTx(station=roadside_station(junction.name), t_ns=city.now, body=body)


def waiting_at_the_signal(make_city):
    city = make_city(hosted=(("n1", "nigel"),))
    city.run_for(20.0)
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-3)
    return city


def test_a_green_heard_over_the_radio_lets_a_waiting_car_go(make_city):
    city = waiting_at_the_signal(make_city)
    for _ in range(4):
        city.run_for(0.5, green(city))
    assert city.shown("n1").speed_mps > 0.1


def test_a_fault_of_the_monitor_outweighs_every_green(make_city):
    city = waiting_at_the_signal(make_city)
    fault = MonitorStatus(junction=MAP.junctions[0].name, t_ns=0, fault="conflict", since_ns=0)
    city.run(1, fault)
    for _ in range(4):
        city.run_for(0.5, green(city))
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-3)


def test_a_car_that_comes_later_knows_of_the_fault_too(city):
    junction = MAP.junctions[0]
    city.run(1, MonitorStatus(junction=junction.name, t_ns=0, fault="dark", since_ns=0))
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.ask(RouteRequest(vehicle="n1"))
    for _ in range(40):
        city.run_for(0.5, green(city))
    assert city.shown("n1").speed_mps == pytest.approx(0.0, abs=1e-3)
    assert city.heard(Trip)[-1].waiting_for == "signal"


def test_a_remote_car_gets_scans_of_walls_and_cars_but_not_of_itself(make_city):
    city = make_city(sensed=True)
    city.join()
    city.run_for(0.5)
    scan = next(s for s in city.heard(LidarScan) if s.vehicle == "n7")
    ranges = np.frombuffer(scan.payload, "<f4")
    assert len(ranges) == scan.beams == 360
    assert np.isfinite(ranges).mean() > 0.5
    assert (scan.sweep_ns, scan.period_ns) == (0, round(NS_PER_S / 7)), "Nigel's looks at once"


def test_a_real_car_is_not_pushed_but_pushes(city):
    city.ask(SpawnRequest(vehicle="n1", spawn="a"))
    city.ask(JoinRequest(vehicle="r1", session="s", kind="real"))
    start = city.world.cars.hosted["n1"].pose
    behind = start @ Pose2(-0.295, 0.0, 0.0)
    report = city.report("r1", x=behind.x, y=behind.y, yaw_rad=behind.yaw, speed_mps=0.2)
    city.run(10, report)
    of_real = [contact for contact in city.heard(Contact) if contact.vehicle == "r1"]
    assert of_real
    assert all(abs(c.dvx_mps) + abs(c.dvy_mps) < 1e-5 for c in of_real)
    pose = city.world.cars.hosted["n1"].pose
    assert np.hypot(pose.x - start.x, pose.y - start.y) > 0.001


def test_a_car_file_without_sensors_still_drives(make_city):
    city = make_city(sensed=True)
    city.ask(SpawnRequest(vehicle="d1", car="dart", spawn="a"))
    city.run_for(0.5)
    assert city.heard(LidarScan) == []
    assert city.shown("d1").car == "dart"


def test_late_ticks_and_lost_time_are_shown(make_city):
    city = make_city()
    city.run_for(1.0)
    city.now += 500 * NS_PER_MS
    city.run_for(0.1)
    snapshot = city.heard(WorldSnapshot)[-1]
    assert snapshot.late_ticks == 1
    assert snapshot.real_time_factor < 0.7


def test_cars_tell_of_their_trips_in_turns(make_city):
    city = make_city(hosted=(("n1", "nigel"), ("n2", "nigel")))
    city.run_for(3.0)
    for name, turn_ms in (("n1", 0), ("n2", 309)):
        told = [trip.t_ns // NS_PER_MS for trip in city.heard(Trip) if trip.vehicle == name]
        assert len(told) >= 6
        assert all(0 <= (t_ms - turn_ms) % 500 < 20 for t_ms in told[2:])


def test_a_box_that_nobody_mapped_is_there_and_not_in_agents_maps():
    city_map = load_map("parking_school_obstacles")
    first, *others = city_map.boxes
    hidden = replace(city_map, boxes=(replace(first, mapped=False), *others))
    part = WorldPart(hidden, room=1)
    (definition,) = (m for m in part.step(0, []) if isinstance(m, WorldDefinition))
    assert [box.name for box in definition.map.boxes] == [box.name for box in others]
    assert not part.world.has_room("nigel", Pose2(first.x_m, first.y_m, 0.0))
