"""A real car's agent, an emulated Nigel on a pseudo-terminal, and the Eye that closes the loop."""

import math
import re
import signal

import pytest

from scm.v2x.bus import Mailbox
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import TYPES_DIR
from tests.e2e.city_process import START_S, wait_for
from tests.e2e.emulated_stage import EmulatedStage

STOP_S = 1.0


class Street(EmulatedStage):
    """Parts of a city, a car behind a cable, and its agent."""

    def __init__(self, endpoint, folder, *args):
        super().__init__(endpoint, folder, *args)
        self.way, self.states = [], Mailbox(5000)
        self.bus.subscribe(VehicleState, {}, self.states)
        self.calibration = folder / "car.toml"
        plain = (TYPES_DIR / "nigel.toml").read_text()
        found = '[drive]\ndeadband = { value = 0.2, std = 0.02, source = "the emulator\'s" }'
        self.calibration.write_text(re.sub(r"^\[drive\].*$", found, plain, flags=re.MULTILINE))

    def drive(self):
        return self.start(
            "vehicle_agent", "join", "--name", "r1", "--connect", self.endpoint,
            "--serial", str(self.link), "--calibration", str(self.calibration),
        )  # fmt: skip

    def pose(self):
        """Return the newest true pose, or None; all of them stay in `way`."""
        new = [item.message for item in self.truth.drain()]
        self.way += new
        return new[-1] if new else None

    def moves(self):
        pose = self.pose()
        return pose is not None and pose.speed_mps > 0.1 and pose

    def error_m(self):
        """Return how far from the truth the newest state is."""
        state = wait_for(self.states.drain, 120.0, "the agent reports")[-1].message
        assert (state.vehicle, state.source) == ("r1", "eye")
        wait_for(lambda: (p := self.pose()) and p.t_ns > state.t_ns, 120.0, "the truth is later")
        near = min(self.way, key=lambda pose: abs(pose.t_ns - state.t_ns))
        return math.hypot(near.x_m - state.x_m, near.y_m - state.y_m)

    def rests(self):
        pose = self.pose()
        return pose is not None and abs(pose.speed_mps) < 0.005 and pose


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    folder = tmp_path_factory.mktemp("street")
    with Street.open(folder, "--name", "r1", parts=("world", "traffic", "eye")) as made:
        yield made


@pytest.mark.parametrize("way", [signal.SIGINT, signal.SIGKILL, signal.SIGSTOP])
def test_it_drives_by_the_eye_and_every_way_out_stops_it(street, way):
    agent = street.drive()
    began = wait_for(street.moves, START_S, "the car moves")
    wait_for(lambda: (pose := street.moves())
             and math.hypot(pose.x_m - began.x_m, pose.y_m - began.y_m) > 0.15,
             30.0, "the car gets somewhere")  # fmt: skip
    assert street.error_m() < 0.05
    agent.send_signal(way)
    wait_for(street.rests, STOP_S, "the car rests")
    agent.kill()
    agent.wait(timeout=5.0)
