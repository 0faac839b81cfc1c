"""Makes the pictures and figures of docs/diagnoses: what is found in other people's cars.

Run with `python docs/make/diagnoses.py ucar dart ...`; needs the shared recordings. The figures go
to the screen, two pictures of each report to docs/diagnoses. `nigel` first drives the recordings
again with two cars, and with its commands as they arrived at the recorder.
"""

import re
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from scm.data_quality.prepare import prepare
from scm.mismatch.evidence import FreeRuns
from scm.mismatch.pipeline import Result, diagnose, write
from scm.mismatch.validate.free_runs import judge
from scm.mismatch.validate.witness import UNSEEN, strayed_by
from scm.recording.read import read_recordings
from scm.replay.free_run import FreeRun, free_run
from scm.vehicles.car import Car, load_car

ROOT = Path(__file__).parents[2]
OUT = ROOT / "docs" / "diagnoses"
DATA = ROOT.parent / "shared" / "recordings"
NIGEL = sorted((ROOT / "recordings" / "nigel_real").glob("*.yaml"))
SLALOM = sorted((ROOT / "recordings" / "f1tenth_optitrack").glob("slalom_*"))
SETS = {
    "ucar": ("cpm_ucar", ["a_first56s.yaml", "b.yaml", "d_warmed_up.yaml"]),
    "slalom": ("f1tenth_optitrack", [path.name for path in SLALOM]),
    "dart": (
        "dart",
        [f"free_driving_{name}.yaml" for name in ("10_01_01", "10_02_28", "10_27_02")],
    ),
    "genesis": ("genesis", ["rfs_path1.yaml", "rfs_path2.yaml"]),
    "av21": ("iac_av21", ["putnam.yaml"]),
    "frictionmaps": ("f1tenth_frictionmaps", ["ds3.yaml"]),
    "las_rccar": ("las_rccar", ["train_1.yaml", "train_2.yaml"]),
    "nigel": ("nigel_real", [path.name for path in NIGEL]),
}
REPLAYED = {"nigel": ("nigel", "nigel_measured")}
REPLAYED_S = (1.0, 2.0)
SHOWN = ("error_position", "numbers")
BUDGET_S = 900.0


def main(names: list[str]) -> None:
    """Diagnose sets by name, or all."""
    OUT.mkdir(exist_ok=True)
    for name in names or list(SETS):
        folder, files = SETS[name]
        paths = [ROOT / "recordings" / folder / file for file in files]
        if name in REPLAYED:
            _replay(paths, DATA / folder, REPLAYED[name])
        found = diagnose(paths, None, DATA / folder, budget_s=BUDGET_S, notify=_progress)
        _print(f"{name}: {len(files)} recordings, {found.diagnosis.runtime_s:.0f} s")
        report = ROOT / "runs" / f"diagnosis-{name}"
        write(found, report)
        _figures(found)
        for picture in sorted((report / "pictures").glob("*.svg")):
            if picture.stem in SHOWN:
                shutil.copy(picture, OUT / f"{name}_{picture.name}")


def _replay(paths: Sequence[Path], data: Path, cars: Sequence[str]) -> None:
    """Print how far free runs stray, with commands when they reached the car and the recorder."""
    with TemporaryDirectory() as folder:
        arrived = [_by_arrival(path, Path(folder)) for path in paths]
        for name in cars:
            car = load_car(name)
            for title, described in (("as they arrived", arrived), ("at the car", paths)):
                runs = [run for path in described for run in _runs(path, data, car)]
                _print(f"{name}, commands {title}: {_strays(runs)}")


def _by_arrival(path: Path, folder: Path) -> Path:
    """Write a description whose commands count from when they were recorded."""
    text = re.sub(
        r"^ *where: received_s.*\n", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    text = re.sub(r"time: \{expression: .*\}", "time: {column: received_s, unit: s}", text)
    written = folder / path.name
    written.write_text(text, encoding="utf-8")
    return written


def _runs(path: Path, data: Path, car: Car) -> list[FreeRun]:
    (recording,) = read_recordings(path, data)
    return [free_run(part, car, REPLAYED_S[-1]) for part in prepare(recording, car).recordings]


def _strays(runs: Sequence[FreeRun]) -> str:
    """Return median and 90th percentile of the errors of all windows together."""
    found = [f"{sum(len(run.start_s) for run in runs)} windows"]
    for t in REPLAYED_S:
        at = int(np.argmin(np.abs(runs[0].t_s - t)))
        position = np.concatenate([run.position_error()[:, at] for run in runs])
        yaw = np.concatenate([run.yaw_error()[:, at] for run in runs])
        (cm, far), (rad, turned) = (np.percentile(e, (50, 90)) for e in (100.0 * position, yaw))
        found.append(f"after {t:g} s {cm:.1f} cm ({far:.1f}), {rad:.3f} rad ({turned:.3f})")
    return "; ".join(found)


def _figures(found: Result) -> None:
    """Print the verdict, each effect, and position errors of free runs held out."""
    diagnosis = found.diagnosis
    _print(f"verdict: {diagnosis.verdict.value}")
    for problem in diagnosis.data:
        _print(f"data: {problem}")
    for effect in diagnosis.effects:
        numbers = ", ".join(
            f"{name} {e.value:.4g} ({e.low:.4g} to {e.high:.4g})"
            for name, e in effect.parameters.items()
        )
        alternatives = ", ".join(f"{r.name} {r.probability:.2f}" for r in effect.alternatives[:3])
        _print(f"effect: {effect.name}: {numbers}; {effect.text} alternatives: {alternatives}")
    for own in found.evidence.refitted:
        if abs(own.found.value - own.given) > 0.5 * (own.given_std or 1.0):
            _print(f"own: {own.key}: {own.given:.4g} -> {own.found.value:.4g}")
    searched, retuned, runs = found.selected, found.retuned_car, found.evidence.free_runs
    if searched is None or retuned is None or runs is None or diagnosis.fit is None:
        return
    horizon_s = diagnosis.fit.horizon_s
    tuned = judge(searched.drives, found.car, retuned, searched.parts, horizon_s)[1]
    _print(f"free runs of {diagnosis.fit.horizon_s:g} s, position [cm], held out:")
    for title, side in (("nominal", runs), ("retuned", tuned), ("found", runs)):
        _print(f"  {title}: {_errors(side, 'before' if title == 'nominal' else 'after')}")
    if (witness := diagnosis.fit.witness) is not None:
        held = np.array(runs.part) == UNSEEN
        windows = runs.recording[held], runs.stamp_s[held]
        far = strayed_by(searched.drives, found.car, windows, horizon_s, witness.numbers)[
            "position_m"
        ]
        _print(f"  bicycle: mean {100.0 * far.mean():.2f}, median {100.0 * np.median(far):.2f}")
    for name, before in diagnosis.fit.confirm.before.items():
        _print(f"  rms {name}: {before:.4g} -> {diagnosis.fit.confirm.after[name]:.4g}")


def _errors(runs: FreeRuns, side: str) -> str:
    held = np.array([part == "confirm" for part in runs.part])
    end = getattr(runs, side)
    miss = [(end[axis] - runs.measured[axis])[held, -1] for axis in ("x", "y")]
    far = 100.0 * np.hypot(*miss)
    return (
        f"{len(far)} windows, mean {far.mean():.2f}, median {np.median(far):.2f}, "
        f"rms {np.sqrt((far**2).mean()):.2f}, p90 {np.percentile(far, 90):.2f}"
    )


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _progress(text: str) -> None:
    sys.stderr.write(f"  {text}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
