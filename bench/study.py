"""Studies beside their limits: overhead of a case, 1 000 trivial cases, memory, reset, search.

Each row prints its share of a limit. Run with `python -m bench study`, on a quiet machine.
"""

import math
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from scm.maps.load import load_map
from scm.study.case_process import CaseProcess, Task
from scm.study.engine import local_engine, own_cores
from scm.study.loaded_study import LoadedStudy, load
from scm.study.results import create_results
from scm.study.run import run_study
from scm.study.search import run_search
from scm.traffic.monitor.part import MonitorPart
from scm.traffic.signals.part import TrafficPart
from scm.world.part import WorldPart

OVERHEAD, TRIVIAL_S, RESET_MS, GROWTH_MB = 0.03, 20.0, 30.0, 20.0
CASES, SEEDS, WITHIN = 1000, 10, 100
CITY = """
def run(case, city_s=10.0, cars=10):
    hosted = tuple((f"n{n}", "nigel") for n in range(cars))
    from scm.traffic.signals.part import TrafficPart
    from scm.traffic.monitor.part import MonitorPart
    parts = [case.world(hosted, room=1), TrafficPart(case.map), MonitorPart(case.map)]
    with case.lockstep(parts) as city:
        city.run_for(city_s)
    return {"value": 0.0}
"""
CORNER = """
import math


def run(case, x=0.0, y=0.0, side="left"):
    away = math.hypot(x - 0.83, y - 0.21) + (0.3 if side == "left" else 0.0)
    return {"value": away + 0.02 * case.generator("noise").normal()}
"""
RADIUS = math.sqrt(0.02 * 2.0 / math.pi)  # of the corner: 2 % of the factors' range
HEAD = 'study = 1\nscenario = "own.py"\nmap = "{city}"\n{more}\n'
MEASURES = '\n[measures.value]\nunit = "1"\n'


def written(
    folder: Path, scenario: str, city: str, more: str, tables: str, name: str
) -> LoadedStudy:
    """Return a study with a scenario of its own."""
    (folder / "own.py").write_text(scenario)
    path = folder / f"{name}.toml"
    path.write_text(HEAD.format(city=city, more=more) + tables + MEASURES)
    return load(path)


def overhead(folder: Path) -> tuple[float, float]:
    """Return the seconds of a case of a city, bare and as a case; the medians of several."""
    tables = "[factors]\ncity_s = 60.0\n"
    study = written(folder, CITY, "grid:3x3", "", tables, "study")
    process = CaseProcess(study, folder)
    bare, cased = [], []
    for number in range(7):
        began = time.perf_counter()
        study.run(number)
        bare.append(time.perf_counter() - began)
        began = time.perf_counter()
        process.run(Task(case=0))
        cased.append(time.perf_counter() - began)
    process.close()
    return statistics.median(bare[1:]), statistics.median(cased[1:])


def trivial(folder: Path) -> float:
    """Return the seconds of 1 000 cases that do nothing, with all that starts and ends."""
    scenario = "def run(case):\n    return {'value': 0.0}\n"
    began = time.perf_counter()
    study = written(folder, scenario, "driving_school", f"replications = {CASES}", "", "study")
    results = create_results(study, folder / "out", [])
    with local_engine(study, folder, own_cores()) as engine:
        run_study(results, engine, lambda _: None)
    took_s = time.perf_counter() - began
    return took_s if len(results.rows) == CASES else math.inf


def growth(folder: Path) -> float:
    """Return by how much a process grows over 1 000 cases of a city with 10 cars [MB]."""
    tables = "[factors]\ncity_s = 0.2\n"
    study = written(folder, CITY, "grid:3x3", f"replications = {2 * CASES}", tables, "study")
    process, used = CaseProcess(study, folder), []
    for number in range(CASES + 50):
        process.run(Task(case=number))
        used.append(process.memory_mb())
    process.close()
    return used[-1] - used[49]


def reset() -> float:
    """Return the milliseconds from nothing to a city with 10 cars, in a process that had one."""
    city_map = load_map("grid:3x3")
    hosted, took = tuple((f"n{n}", "nigel") for n in range(10)), []
    for _ in range(12):
        began = time.perf_counter()
        world = WorldPart(city_map, 1, hosted, room=1)
        TrafficPart(city_map), MonitorPart(city_map)
        world.step(0, [])
        took.append(1e3 * (time.perf_counter() - began))
    return statistics.median(took[2:])


def searches(folder: Path) -> list[int]:
    """Return after how many cases each search found the corner; a case more if it did not."""
    found = []
    tables = (
        "[factors]\nx = { uniform = [0.0, 1.0] }\ny = { uniform = [0.0, 1.0] }\n"
        'side = ["left", "right"]\n[search]\nmeasure = "value"\ngoal = "minimize"\n'
        f"cases = {WITHIN}\nstop_below = {RADIUS:.4f}\n"
    )
    for seed in range(SEEDS):
        below = folder / str(seed)
        below.mkdir()
        study = written(below, CORNER, "driving_school", f"seed = {seed}", tables, "study")

        class Here:
            about, cores = "here", 1

            def run(self, tasks, study=study):
                for task in tasks:
                    yield study.run(task.case, task.values)

        end = run_search(create_results(study, below / "out", []), Here(), lambda _: None)
        found.append(end.cases if end.is_beyond else WITHIN + 1)
    return found


def main() -> None:
    """Print a table."""
    print("| what | | limit | of it |\n|---|---:|---:|---:|")

    def row(what: str, value: float, unit: str, limit: float) -> None:
        print(
            f"| {what} | {value:.3g} {unit} | {limit:g} {unit} | {value / limit:.0%} |", flush=True
        )

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in ("overhead", "trivial", "growth", "search"):
            (folder / part).mkdir()
        bare_s, case_s = overhead(folder / "overhead")
        what = f"overhead of a case of {bare_s:.1f} s"
        row(what, 100.0 * (case_s / bare_s - 1.0), "%", 100.0 * OVERHEAD)
        row(
            f"{CASES} trivial cases on {own_cores()} cores",
            trivial(folder / "trivial"),
            "s",
            TRIVIAL_S,
        )
        row("reset of a city with 10 cars", reset(), "ms", RESET_MS)
        row(f"growth over {CASES} cases with 10 cars", growth(folder / "growth"), "MB", GROWTH_MB)
        counts = searches(folder / "search")
    within, chance = sum(count <= WITHIN for count in counts), 1.0 - 0.98**WITHIN
    what = f"searches that find a corner of 2 % within {WITHIN} cases"
    print(f"| {what} | {within} of {SEEDS} | 9 of {SEEDS} | random: {SEEDS * chance:.1f} |")
    median, expected = np.median(counts), math.log(0.5) / math.log(0.98)
    of_it = f"{median / expected:.0%} of random's {expected:.0f}"
    print(f"| cases until then, median | {median:.0f} | | {of_it} |")


if __name__ == "__main__":
    main()
