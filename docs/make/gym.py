"""docs/pictures/gym_learning.png and gym_lap.gif: how a car learns laps, and how it drives then.

    python -m docs.make.gym [--minutes 4]

Runs examples/train_ppo.py and plots what it prints; then lets the policy drive one world. Takes so
many minutes and one more.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import scm.gym
from docs.make.drawing import plt
from vehicle_agent.policy.model import Policy

TASK, SEED = "driving_school/lap-v1", 7
PICTURES = Path("docs/pictures")
LINE = re.compile(r"\s*([\d.]+) s\s+(\d+) steps,\s+\d+/s, return\s+(-?[\d.]+)")
EVERY, FRAMES, SIDE_PX, COLOURS = 3, 160, 420, 48  # steps of 50 ms between pictures of the GIF


def learn(minutes: float, out: Path) -> np.ndarray:
    """Train a policy; return seconds, steps and mean return as they were printed, (n, 3)."""
    command = [sys.executable, "examples/train_ppo.py", TASK, "--minutes", str(minutes)]
    done = subprocess.run(
        [*command, "--out", str(out)], check=True, capture_output=True, text=True
    )  # fmt: skip
    return np.array([[float(v) for v in one] for one in LINE.findall(done.stdout)])


def plot(curve: np.ndarray, path: Path) -> None:
    """Plot the mean return of the newest episodes over the time of learning."""
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    axes.plot(curve[:, 0], curve[:, 2], color="#4c8df0")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("return of an episode [m, less penalties]")
    axes.set_title(f"{TASK}, {curve[-1, 1] / 1e6:.1f} million steps", loc="left", fontsize=10)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)


def film(policy: Policy, path: Path) -> float:
    """Let a policy drive one world, write an animated GIF; return how far the car came [m]."""
    env = scm.gym.CityEnv(TASK, render_mode="rgb_array")
    seen, _ = env.reset(seed=SEED)
    frames, way_m = [], 0.0
    for step in range(EVERY * FRAMES):
        seen, gain, ended, over, _ = env.step(policy(seen.astype(float)))
        way_m += gain
        if ended or over:
            break
        if step % EVERY == 0:
            picture = Image.fromarray(np.asarray(env.render()))
            picture.thumbnail((SIDE_PX, SIDE_PX))
            frames.append(picture.quantize(COLOURS, dither=Image.Dither.NONE))
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=50 * EVERY, loop=0, optimize=True
    )
    return way_m


def main() -> None:
    """Make both pictures."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.gym", description=__doc__)
    parser.add_argument("--minutes", type=float, default=4.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "lap.onnx"
        plot(learn(given.minutes, out), PICTURES / "gym_learning.png")
        way_m = film(Policy(out), PICTURES / "gym_lap.gif")
        sys.stdout.write(f"{way_m:.1f} m in the film\n")


if __name__ == "__main__":
    main()
