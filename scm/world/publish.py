"""The last stage of a tick: what the city is told, each kind at its own rate."""

from scm.clock import NS_PER_MS
from scm.v2x.etsi_convert import cam_of
from scm.v2x.message import Message
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.lights import lamps
from scm.world.hosted import HostedCar
from scm.world.remote import RemoteCar
from scm.world.world import NAME, World


def publish(world: World, now_ns: int) -> None:
    """Put states, snapshot, trips, contacts and vital signs into the outbox."""
    for car in world.hosted.values():
        world.outbox.append(state_of(car, now_ns))
    for remote in world.remote.values():
        contact = remote.contact(now_ns)
        if contact is not None:
            world.outbox.append(contact)
    if world.every["snapshot"].is_due(now_ns):
        world.outbox.append(snapshot(world, now_ns))
    _trips(world, now_ns)
    if world.every["second"].is_due(now_ns):
        world.outbox += _each_second(world, now_ns)


def state_of(car: HostedCar, now_ns: int) -> VehicleState:
    """Return a hosted car's report of itself, and count it."""
    fleet, row = car.fleet, car.row
    car.seq += 1
    x, y, yaw = car.pose
    return VehicleState(
        vehicle=car.name,
        t_ns=now_ns,
        seq=car.seq,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        speed_mps=float(fleet.speed[row]),
        lateral_speed_mps=float(fleet.lateral_speed[row]),
        yaw_rate_radps=float(fleet.yaw_rate[row]),
        accel_mps2=float(fleet.accel_x[row]),
        steering_rad=float(fleet.steer_angle[row]),
        throttle=float(fleet.throttle[row]),
        source="simulated",
        epoch=car.lease.epoch,
        mode=car.mode,
        lights=lights_of(car, now_ns),
        car=car.car_file,
    )


def lights_of(car: HostedCar, now_ns: int) -> tuple[str, ...]:
    """Return the names of the lamps that are on."""
    throttle = float(car.fleet.throttle[car.row])
    return lamps(car.switches, throttle, car.speed, now_ns, hazard=car.hazard)


def snapshot(world: World, now_ns: int) -> WorldSnapshot:
    """Return the truth of this instant."""
    return WorldSnapshot(
        t_ns=now_ns,
        tick=world.tick,
        vehicles=(
            *(_hosted_in_snapshot(car, now_ns) for car in world.hosted.values()),
            *(_remote_in_snapshot(car, now_ns) for car in world.remote.values()),
        ),
        real_time_factor=world.pace.real_time_factor,
        late_ticks=world.pace.late_ticks,
    )


def _hosted_in_snapshot(car: HostedCar, now_ns: int) -> SnapshotVehicle:
    fleet, row = car.fleet, car.row
    x, y, yaw = car.pose
    return SnapshotVehicle(
        vehicle=car.name,
        kind=car.kind,
        car=car.car_file,
        tag_id=car.tag_id,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        speed_mps=car.speed,
        steering_rad=float(fleet.steer_angle[row]),
        roll_rad=float(fleet.roll[row]),
        pitch_rad=float(fleet.pitch[row]),
        owner=car.lease.owner,
        epoch=car.lease.epoch,
        mode=car.mode,
        lights=lights_of(car, now_ns),
    )


def _remote_in_snapshot(car: RemoteCar, now_ns: int) -> SnapshotVehicle:
    state = car.state
    x, y, yaw = car.pose
    return SnapshotVehicle(
        vehicle=car.name,
        kind=car.kind,
        car=car.car_file,
        tag_id=car.tag_id,
        x_m=x,
        y_m=y,
        yaw_rad=yaw,
        speed_mps=car.speed,
        steering_rad=0.0 if state is None else state.steering_rad,
        owner=car.lease.owner,
        epoch=car.lease.epoch,
        mode="idle" if state is None else state.mode,
        age_ms=car.age_ns(now_ns) / NS_PER_MS,
        alive=car.alive,
        lights=() if state is None else state.lights,
    )


def cams_due(world: World, states: list[VehicleState], now_ns: int) -> list[CamTx]:
    """Return the CAMs that hosted cars owe the air."""
    cams = []
    for state in states:
        car = world.hosted[state.vehicle]
        if car.cam_trigger.due(state, now_ns):
            rear, front = car.car.vector("body.footprint_x_m")
            right, left = car.car.vector("body.footprint_y_m")
            body = cam_of(state, length_m=front - rear, width_m=left - right, front_m=front)
            cams.append(CamTx(station=car.name, t_ns=now_ns, body=body))
    return cams


def _trips(world: World, now_ns: int) -> None:
    for car in world.hosted.values():
        if car.trips is not None and car.is_sent:
            world.outbox += car.trips.reports(now_ns)


def _each_second(world: World, now_ns: int) -> list[Message]:
    count = len(world.hosted) + len(world.remote)
    lost = world.pace.lost_ns // NS_PER_MS
    detail = f"{count} car{'s' * (count != 1)}" + (f", {lost} ms of time lost" if lost else "")
    status = PartStatus(station=NAME, t_ns=now_ns, detail=detail)
    return [status, world.stop] if world.stop.engaged else [status]
