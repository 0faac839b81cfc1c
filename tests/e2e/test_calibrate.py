"""`vehicle-agent calibrate` over a cable, under an Eye of real processes: the file is right."""

import re
import subprocess
import sys

import numpy as np
import pytest

from scm.geometry import Pose2
from scm.parent_watch import with_parent
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.router import Router, free_endpoint
from scm.vehicles.car import load_car
from tests.unit.calibrate.cable import Emulated
from vehicle_agent.guard import GuardLimits, rectangle

FLOOR = (1.3, 0.1, 2.8, 1.35)
MOVED = Emulated(trim=0.04, gain=0.9, drive=0.9)
TAG = 9
LONGEST_S = 90.0
STDS = 3.0  # of each number: one run in 75 of five right ones would miss by more


class Stage:
    """World, Eye and an emulated car, all processes of their own, and an ear for the truth."""

    def __init__(self, endpoint, folder):
        self.endpoint, self.link, self.children = endpoint, folder / "nigel", []
        self.truth = Mailbox(50_000)
        self.bus = ZenohBus("city", "test", endpoint)
        self.bus.subscribe(EmulatedPose, {}, self.truth)
        hidden = folder / "hidden.toml"
        MOVED.write(hidden)
        for part in ("world", "eye"):
            self.start("scm", part, "driving_school", "--connect", endpoint)
        self.start("vehicle_agent", "emulate", "--link", str(self.link), "--connect", endpoint,
                   "--name", "n7", "--tag", str(TAG), "--car", str(hidden), "--spawn", "c",
                   "--deadband", str(MOVED.deadband))  # fmt: skip

    def start(self, *command):
        self.children.append(subprocess.Popen(with_parent([sys.executable, "-m", *command])))

    def close(self):
        for child in self.children:
            child.kill()
            child.wait(timeout=5.0)
        self.bus.close()


@pytest.fixture
def stage(tmp_path):
    with Router(free_endpoint()) as router:
        made = Stage(router.listen, tmp_path)
        try:
            yield made
        finally:
            made.close()


def test_a_real_nigel_is_calibrated_inside_its_rectangle(stage, tmp_path):
    out = tmp_path / "found"
    command = [sys.executable, "-m", "vehicle_agent", "calibrate", "--name", f"tag-{TAG}",
               "--connect", stage.endpoint, "--serial", str(stage.link), "--short",
               "--floor", *map(str, FLOOR), "--out", str(out)]  # fmt: skip
    done = subprocess.run(with_parent(command), capture_output=True, text=True, check=False,
                          timeout=LONGEST_S)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    limits = GuardLimits(rectangle(*FLOOR), margin_m=0.0)
    way = [item.message for item in stage.truth.drain()]
    assert max(limits.outside_m(Pose2(at.x_m, at.y_m, at.yaw_rad)) for at in way) < 0.0
    car = load_car(out / "car.toml")
    for key, truth in MOVED.numbers.items():
        assert abs(car.value(key) - truth) < STDS * car.quantity(key).std, f"{key}\n{done.stdout}"
    before, after = map(float, re.findall(r"by ([\d.]+) mm with th", done.stdout))
    assert after < 0.2 * before
    poses = np.loadtxt(out / "drive" / "pose.csv", delimiter=",", skiprows=1)
    assert len(poses) > 100
    assert "<svg" in (out / "fit.svg").read_text(encoding="utf-8")
