"""Live calibrations, again and again: `python -m tests.e2e.live_drives OUT [KEY=VALUE ...]`.

Each drives an emulated Nigel with hidden numbers of its own, on the firmware of its board behind a
pseudo-terminal, under an Eye of real processes. Keys: `draws=10`, `first=1`, `plan=short|full`.
Left in OUT/SEED: the drive; `truth.csv`, where the car truly was; `eye.csv`, where the Eye said it
was; `board.csv`, what the board obeyed and when; `numbers.json`, the hidden numbers.
"""

import json
import signal
import subprocess
import sys
from pathlib import Path

from scm.runtime.parent_watch import with_parent
from scm.v2x.bus import Mailbox
from scm.v2x.bus_zenoh import ZenohBus
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.router import Router, free_endpoint
from tests.unit.calibrate.cable import emulated

FLOOR = (1.3, 0.1, 2.8, 1.35)
TAG = 9
LONGEST_S = {"short": 200.0, "full": 400.0}
FITS_S = 60.0
POSES = "t_ns,x,y,yaw"


class Stage:
    """World, Eye and an emulated car, all processes of their own, and an ear for the truth."""

    def __init__(self, endpoint, folder, moved):
        self.endpoint, self.folder, self.link = endpoint, folder, folder / "nigel"
        self.out, self.children = folder / "found", []
        self.truth, self.eye = Mailbox(50_000), Mailbox(50_000)
        self.bus = ZenohBus("city", "test", endpoint)
        self.bus.subscribe(EmulatedPose, {}, self.truth)
        self.bus.subscribe(EyePose, {}, self.eye)
        hidden = folder / "hidden.toml"
        moved.write(hidden)
        for part in ("world", "eye"):
            self.start("scm", part, "driving_school", "--connect", endpoint)
        self.start("tests.e2e.board_log", str(folder / "board.csv"), "emulate",
                   "--link", str(self.link), "--connect", endpoint, "--name", "n7",
                   "--tag", str(TAG), "--car", str(hidden), "--spawn", "c",
                   "--deadband", str(moved.deadband))  # fmt: skip

    def start(self, *command):
        self.children.append(subprocess.Popen(with_parent([sys.executable, "-m", *command])))

    def calibrate(self, *more, longest_s=LONGEST_S["short"]):
        """Drive and fit, what was driven in so long at most; return the exit code and the words."""
        command = [sys.executable, "-m", "vehicle_agent", "calibrate", "--name", f"tag-{TAG}",
                   "--connect", self.endpoint, "--serial", str(self.link),
                   "--floor", *map(str, FLOOR), "--out", str(self.out), *more]  # fmt: skip
        drives = subprocess.Popen(with_parent(command), stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)  # fmt: skip
        try:
            said, _ = drives.communicate(timeout=longest_s)
        except subprocess.TimeoutExpired:
            drives.send_signal(signal.SIGINT)
            said, _ = drives.communicate(timeout=FITS_S)
        finally:
            drives.kill()
        return drives.returncode, said

    def close(self):
        for child in self.children:
            child.kill()
            child.wait(timeout=5.0)
        self.bus.close()


def drive(folder, seed, plan):
    """Drive once and leave everything in a folder."""
    folder.mkdir(parents=True)
    moved = emulated(seed)
    (folder / "numbers.json").write_text(json.dumps(moved.numbers))
    with Router(free_endpoint()) as router:
        stage = Stage(router.listen, folder, moved)
        try:
            short = ["--short"] if plan == "short" else []
            _, said = stage.calibrate(*short, longest_s=LONGEST_S[plan])
            (folder / "said.txt").write_text(said)
            for name, box in (("truth", stage.truth), ("eye", stage.eye)):
                heard = [item.message for item in box.drain()]
                rows = [f"{at.t_ns},{at.x_m:.7f},{at.y_m:.7f},{at.yaw_rad:.7f}" for at in heard]
                (folder / f"{name}.csv").write_text("\n".join([POSES, *rows, ""]))
        finally:
            stage.close()


def main(out, *settings):
    told = dict(each.split("=") for each in settings)
    first, draws = int(told.get("first", 1)), int(told.get("draws", 10))
    for seed in range(first, first + draws):
        try:
            drive(Path(out) / str(seed), seed, told.get("plan", "short"))
        except subprocess.TimeoutExpired:
            print(f"{seed}: did not end in time", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
