"""The CAM rule for all cars at once says what the rule for one car says."""

import numpy as np

from scm.clock import NS_PER_MS
from scm.geometry import Pose2
from scm.v2x.cam_trigger import CamTrigger
from scm.v2x.messages.vehicle_state import VehicleState
from scm.world.cams import CamTriggers
from scm.world.slots import Slots

CARS, TICKS = 40, 400


def state(slots, slot):
    return VehicleState(
        vehicle=slots.names[slot], t_ns=0, seq=0, x_m=slots.x[slot], y_m=slots.y[slot],
        yaw_rad=slots.yaw[slot], speed_mps=slots.speed[slot], yaw_rate_radps=0.0,
        steering_rad=0.0, throttle=0.0, source="simulated",
    )  # fmt: skip


def city_of(cars):
    slots = Slots(cars + 3)
    for i in range(cars):
        slots.take(f"n{i}", Pose2(0.0, 0.0, 3.1), hosted=i % 7 != 0)
    return slots


def test_all_cars_send_exactly_when_each_alone_would():
    rng = np.random.default_rng(1)
    slots = city_of(CARS)
    together, alone = CamTriggers(slots.capacity), [CamTrigger() for _ in range(CARS)]
    sends = 0
    for tick in range(TICKS):
        now_ns = tick * 20 * NS_PER_MS
        slots.x += 0.02 * rng.random(slots.capacity) * (np.arange(slots.capacity) % 3)
        slots.yaw = np.mod(slots.yaw + 0.03 * rng.random(slots.capacity) + np.pi, 2 * np.pi) - np.pi
        slots.speed += 0.004 * rng.random(slots.capacity) * (np.arange(slots.capacity) % 2)
        expected = [
            i for i in range(CARS) if slots.hosted[i] and alone[i].due(state(slots, i), now_ns)
        ]
        due = together.due(slots, now_ns).tolist()
        sends += len(due)
        assert due == expected
    assert sends > 10 * CARS


def test_the_next_car_in_a_slot_sends_at_once():
    slots = city_of(2)
    triggers = CamTriggers(slots.capacity)
    assert triggers.due(slots, 0).tolist() == [1]
    slots.free(1)
    triggers.forget(1)
    slots.take("n9", Pose2(0.0, 0.0, 0.0), hosted=True)
    assert triggers.due(slots, 20 * NS_PER_MS).tolist() == [1]
