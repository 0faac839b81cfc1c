"""Makes docs/pictures/{commonroad,tiny_town_drive}.png: our cars beside other people's simulators.

Run with `python docs/make/evidence.py`; needs `pip install -e '.[docs]'`, and for the second
picture the shared recordings.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from drawing import plt
from matplotlib.axes import Axes

from scm.recording.read import read_recordings
from scm.replay.free_run import FreeRun, free_run
from scm.vehicles.car import Car, load_car
from tests.physics import commonroad_twin as twin

ROOT = Path(__file__).parents[2]
OUT = ROOT / "docs" / "pictures"
TINY_TOWN = ROOT.parent / "shared" / "recordings" / "autodrive_sim_tinytown"
RATE, LOCK = "steering.rate_rad_s", "drive.axle_lock"
DOCUMENTED = (
    ("nominal: servo of the paper", {RATE: 0.42, LOCK: 0.0}),
    ("servo of the newest simulator", {RATE: 5.5, LOCK: 0.0}),
    ("and a motor for each wheel", {RATE: 5.5, LOCK: 1.0}),
)


def main() -> None:
    """Draw both pictures."""
    commonroad()
    if TINY_TOWN.exists():
        tiny_town()


def commonroad() -> None:
    """Draw yaw rate, side speed and path of the three models in every manoeuvre."""
    figure, rows = plt.subplots(len(twin.MANOEUVRES), 3, figsize=(14, 13))
    for axes, manoeuvre in zip(rows, twin.MANOEUVRES, strict=True):
        mine, angle = twin.ours(manoeuvre)
        others = {
            "CommonRoad single-track": twin.single_track(mine, angle),
            "CommonRoad multi-body": twin.multi_body(mine, angle),
        }
        styles = {"ours": (mine, "k-", 2.4), **_styled(others)}
        for label, (motion, style, width) in styles.items():
            axes[0].plot(motion.t, motion.yaw_rate, style, linewidth=width, label=label)
            axes[1].plot(motion.t, motion.lateral_speed, style, linewidth=width)
            axes[2].plot(motion.x, motion.y, style, linewidth=width)
        axes[0].set(title=manoeuvre.name, xlabel="time [s]", ylabel="yaw rate [rad/s]")
        axes[1].set(xlabel="time [s]", ylabel="side speed [m/s]")
        axes[2].set(xlabel="x [m]", ylabel="y [m]")
        axes[2].set_aspect("equal", adjustable="datalim")
        axes[1].set_title("   ".join(_off(label, other, mine) for label, other in others.items()),
                          fontsize=9)  # fmt: skip
    rows[0, 0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(OUT / "commonroad.png", dpi=80)


def _off(label: str, other: twin.Motion, mine: twin.Motion) -> str:
    off = other.yaw_rate - mine.yaw_rate
    share = 100.0 * np.sqrt(np.mean(off**2)) / np.abs(mine.yaw_rate).max()
    end = 100.0 * np.hypot(other.x[-1] - mine.x[-1], other.y[-1] - mine.y[-1])
    return f"{label.removeprefix('CommonRoad ')}: yaw rate {share:.1f} %, end {end:.1f} cm off"


def _styled(others: dict[str, twin.Motion]) -> dict[str, tuple[twin.Motion, str, float]]:
    return {
        label: (motion, style, 1.2)
        for (label, motion), style in zip(others.items(), ("C1--", "C0-"), strict=True)
    }


def tiny_town() -> None:
    """Draw free runs of 3 s over the recorded drive, with what documents say of the car."""
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.8))
    (recording,) = read_recordings(ROOT / "recordings" / "autodrive_sim_tinytown.yaml", TINY_TOWN)
    for (label, values), plan in zip(DOCUMENTED, (axes[0], None, axes[1]), strict=True):
        run = free_run(recording, _changed(load_car("nigel"), values))
        if plan is not None:
            _plan(plan, run, label)
        median = 100.0 * np.median(run.position_error(), axis=0)
        at = [int(np.argmin(np.abs(run.t_s - horizon))) for horizon in (1.0, 3.0)]
        after = " and ".join(f"{median[k]:.1f}" for k in at)
        axes[2].plot(run.t_s, median, label=f"{label}: {after} cm")
    axes[2].set(
        xlabel="free run [s]", ylabel="position error [cm]", title="median error; after 1 and 3 s:"
    )
    axes[2].legend(fontsize=8, loc="upper left")
    axes[2].set_ylim(0.0, 8.0)
    figure.tight_layout()
    figure.savefig(OUT / "tiny_town_drive.png", dpi=80)


def _changed(car: Car, values: dict[str, float]) -> Car:
    new = {key: replace(car.quantity(key), value=value) for key, value in values.items()}
    return replace(car, values={**car.values, **new})


def _plan(axis: Axes, run: FreeRun, label: str) -> None:
    for k in range(len(run.start_s)):
        axis.plot(run.x_measured[k], run.y_measured[k], "k-", linewidth=3, alpha=0.3)
        axis.plot(run.x[k], run.y[k], "-", linewidth=1.3)
        axis.plot(run.x[k, 0], run.y[k, 0], "k.", markersize=5)
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=label)


if __name__ == "__main__":
    main()
