"""The CAM rule for all cars at once says what the rule for one car says."""

import numpy as np

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.v2x.cam_trigger import CamTrigger
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.cam_triggers import CamTriggers
from scm.world.vehicle_arrays import VehicleArrays

CARS, TICKS = 40, 400


def state(vehicles, index):
    return VehicleState(
        vehicle=vehicles.names[index], t_ns=0, seq=0, x_m=vehicles.x[index], y_m=vehicles.y[index],
        yaw_rad=vehicles.yaw[index], speed_mps=vehicles.speed[index], yaw_rate_radps=0.0,
        steering_rad=0.0, throttle=0.0, source="simulated",
    )  # fmt: skip


def city_of(cars):
    vehicles = VehicleArrays(cars + 3)
    for i in range(cars):
        vehicles.add(f"n{i}", Pose2(0.0, 0.0, 3.1), hosted=i % 7 != 0)
    return vehicles


def test_all_cars_send_exactly_when_each_alone_would():
    rng = np.random.default_rng(1)
    vehicles = city_of(CARS)
    together, alone = CamTriggers(vehicles.capacity), [CamTrigger() for _ in range(CARS)]
    sends = 0
    for tick in range(TICKS):
        now_ns = tick * 20 * NS_PER_MS
        vehicles.x += 0.02 * rng.random(vehicles.capacity) * (np.arange(vehicles.capacity) % 3)
        vehicles.yaw = (
            np.mod(vehicles.yaw + 0.03 * rng.random(vehicles.capacity) + np.pi, 2 * np.pi) - np.pi
        )
        vehicles.speed += 0.004 * rng.random(vehicles.capacity) * (np.arange(vehicles.capacity) % 2)
        expected = [
            i
            for i in range(CARS)
            if vehicles.hosted[i] and alone[i].due(state(vehicles, i), now_ns)
        ]
        due = together.due(vehicles, now_ns).tolist()
        sends += len(due)
        assert due == expected
    assert sends > 10 * CARS


def test_the_next_car_in_a_slot_sends_at_once():
    vehicles = city_of(2)
    triggers = CamTriggers(vehicles.capacity)
    assert triggers.due(vehicles, 0).tolist() == [1]
    vehicles.remove(1)
    triggers.forget(1)
    vehicles.add("n9", Pose2(0.0, 0.0, 0.0), hosted=True)
    assert triggers.due(vehicles, 20 * NS_PER_MS).tolist() == [1]
