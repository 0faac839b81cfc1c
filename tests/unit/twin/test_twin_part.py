"""The twin part gets what cars report, and reports since when one has changed."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from scm.clock import NS_PER_MS, NS_PER_S, nanoseconds
from scm.geometry import wrap_angle
from scm.twin.part import GONE_NS, TwinPart
from scm.v2x.exchange import Incoming
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from tests.unit.mismatch.made_drive import made_drive
from tests.unit.twin.test_watch import BIAS, LASTS_S, SINCE_S, biased

BEGAN_NS = 1_700_000_000 * NS_PER_S
EVERY_S = 0.02


def reports(recording, name="n1", lasts_s=LASTS_S):
    """Return what the car of a recording would report, one list a step of 0.1 s."""
    t = np.arange(0.1, lasts_s - 0.1, EVERY_S)

    def at(channel):
        one = recording.channels[channel]
        values = np.unwrap(one.values) if channel == "pose.yaw" else one.values
        return np.interp(t, one.t, values).tolist()

    x, y, yaw, gyro, left, right, ax, ay = map(at, (
        "pose.x", "pose.y", "pose.yaw", "imu.gyro_z", "encoder.left", "encoder.right",
        "imu.accel_x", "imu.accel_y",
    ))  # fmt: skip
    command = recording.channels["command.throttle"].t
    row = np.searchsorted(command, t - 0.5 * EVERY_S, side="right") - 1
    throttle, steering = (
        recording.channels[f"command.{which}"].values[row].tolist()
        for which in ("throttle", "steering")
    )
    steps = [[]]
    for k, t_s in enumerate(t.tolist()):
        t_ns = BEGAN_NS + nanoseconds(t_s)
        state = VehicleState(
            vehicle=name, t_ns=t_ns, seq=k, x_m=x[k], y_m=y[k], yaw_rad=wrap_angle(yaw[k]),
            speed_mps=0.2, yaw_rate_radps=0.0, steering_rad=0.0, throttle=throttle[k],
            steering=steering[k], source="simulated",
        )  # fmt: skip
        sensors = VehicleSensors(
            vehicle=name, t_ns=t_ns, encoder_left=round(left[k]), encoder_right=round(right[k]),
            accel_mps2=(ax[k], ay[k], 9.81), gyro_radps=(0.0, 0.0, gyro[k]),
        )  # fmt: skip
        steps[-1] += [state, sensors]
        if k % 5 == 4:
            steps.append([])
    return steps


def run(part, steps):
    """Let the part work; return all that it sends."""
    out, now_ns = [], BEGAN_NS
    for messages in steps:
        now_ns += 100 * NS_PER_MS
        out += part.step(now_ns, [Incoming(message, now_ns) for message in messages])
    return out, now_ns


@pytest.fixture(scope="module")
def changed():
    return reports(made_drive(seconds=LASTS_S, sense=biased))


def test_change_is_an_event_and_stays_in_the_status(changed):
    out, _ = run(TwinPart(), changed)
    (event,) = [one for one in out if isinstance(one, CityEvent)]
    assert (event.severity, event.name, event.vehicle) == ("warning", "car_changed", "n1")
    assert event.text.startswith("n1 is not what nigel says any more, since ")
    assert "gyro_bias" in event.text
    statuses = [one for one in out if isinstance(one, TwinStatus)]
    assert len(statuses) == pytest.approx(LASTS_S / 10.0, abs=2)
    assert statuses[0].state == "learning"
    assert "watching" in {one.state for one in statuses}
    assert all(0.0 <= b.driven_s - a.driven_s <= 11.0 for a, b in pairwise(statuses))
    (change,) = statuses[-1].changes
    assert change.effect == "gyro_bias"
    assert change.size == pytest.approx(BIAS, rel=0.3)
    assert change.since_low_ns <= BEGAN_NS + SINCE_S * NS_PER_S <= change.since_high_ns
    assert [one.detail for one in out if isinstance(one, PartStatus)][-1] == (
        "1 cars watched, 1 changed"
    )


@pytest.mark.parametrize(
    ("lacks", "words"),
    [({"steering": None}, "no command that it obeyed is known"), ({"car": "unicorn"}, "unicorn")],
)
def test_car_that_cannot_be_predicted_is_blind_in_words(changed, lacks, words):
    strange = [
        [replace(one, **lacks) if isinstance(one, VehicleState) else one for one in step]
        for step in changed[:300]
    ]
    out, _ = run(TwinPart(), strange)
    last = [one for one in out if isinstance(one, TwinStatus)][-1]
    assert last.state == "blind"
    assert words in last.reason


def test_clock_that_jumps_is_no_change_and_nothing_piles_up(changed):
    hour = 3600 * NS_PER_S
    later = [[replace(one, t_ns=one.t_ns + hour) for one in step] for step in changed[1500:3000]]
    part = TwinPart()
    out, _ = run(part, [*changed[:1500], *later, *changed[:300]])
    assert not [one for one in out if isinstance(one, CityEvent)]
    assert [one for one in out if isinstance(one, TwinStatus)][-1].driven_s > 280.0
    assert len(part._cars["n1"]._messages.reports) < 800
    part.step(BEGAN_NS + 10 * hour + GONE_NS, [])
    assert part._cars == {}
