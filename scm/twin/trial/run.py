"""A whole live trial: scenes are drawn and sealed, cities played, labels opened, all is judged.

A city that was played is not played again: a trial that was interrupted goes on with the others.
"""

import math
from concurrent.futures import Executor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import msgspec

from scm.errors import RecordingError, RunError
from scm.maps.load import load_map
from scm.mismatch.trial import labels
from scm.mismatch.trial.run import FOUND, Notify, silent
from scm.twin.trial.city import CAR, FOUND_FILE, CityFound, CityRequest, play, scene_of
from scm.twin.trial.score import Judged, judge_city
from scm.twin.trial.table import each, lines
from vehicle_agent.bodies.reality import engine_of, reality

REQUEST, RESULT, TABLE = "request.json", "result.json", "table.txt"
MOST_HOURS, MOST_CARS = 48.0, 100


@dataclass(frozen=True, slots=True)
class LiveTrial:
    """A trial: as many cities as `cities`, each like `city` but with a scene of its own."""

    city: CityRequest
    cities: int = 1

    def requests(self) -> list[CityRequest]:
        """Return the request of each city."""
        return [replace(self.city, number=number) for number in range(self.cities)]


def check(trial: LiveTrial) -> None:
    """Check that a trial is possible.

    Raises:
        RunError: names the option, what is expected, and what was given.
    """
    city = trial.city
    if not 0.0 < city.hours <= MOST_HOURS:
        raise RunError(f"--hours: expected more than 0, at most {MOST_HOURS:g}, got {city.hours:g}")
    places = len(load_map(city.map).spawns)
    if not 1 <= city.cars <= places:
        msg = f"--cars: expected 1 to {places}, the spawn places of {city.map}, got {city.cars}"
        raise RunError(msg)
    if trial.cities < 1:
        raise RunError(f"--cases: expected at least 1 city, got {trial.cities}")
    low, high = city.strength
    if not 0.0 < low <= high:
        raise RunError(f"--strength: expected two numbers above 0 that rise, got {low:g} {high:g}")
    if not 0.0 < city.budget_s < math.inf:
        raise RunError(f"--budget-s: expected more than 0, got {city.budget_s:g}")
    reality("scenes")
    engine_of(city.engine)


def run(
    trial: LiveTrial, out: Path, executor: Executor | None = None, notify: Notify = silent
) -> list[str]:
    """Play a trial's cities, or those of it that are missing in `out`; return the table.

    Args:
        trial: What is to be played.
        out: Folder of the trial.
        executor: What runs a task a city; None: here, one after another.
        notify: Receives how far it is.

    Raises:
        RunError: when the trial is not possible.
        RecordingError: when `out` holds another trial, or a label is not what was sealed.
    """
    check(trial)
    _seal(trial, out)
    seals = labels.read_seals(out)
    waiting = [one for one in trial.requests() if not _file(out, one).is_file()]
    if executor is None:
        for done, request in enumerate(waiting):
            total_s = round(3600.0 * request.hours)
            play(
                request, _file(out, request).parent,
                lambda t_s, d=done, s=total_s: notify(  # type: ignore[misc]
                    "driving [s]", d * s + round(t_s), len(waiting) * s
                ),
            )  # fmt: skip
    else:
        tasks = [executor.submit(play, one, _file(out, one).parent) for one in waiting]
        for done, task in enumerate(as_completed(tasks), 1):
            task.result()
            notify("cities", done, len(tasks))
    return _judge(trial, out, seals)


def judged_again(out: Path) -> list[str]:
    """Judge what the cities of a trial found once more; return the table.

    Raises:
        RecordingError: when `out` holds no trial, or not all of it.
    """
    path = out / REQUEST
    if not path.is_file():
        raise RecordingError(f"{out}: holds no live trial: no {REQUEST}")
    trial = msgspec.json.decode(path.read_bytes(), type=LiveTrial)
    return _judge(trial, out, labels.read_seals(out))


def _seal(trial: LiveTrial, out: Path) -> None:
    """Write the sealed labels, or find those of the same trial."""
    path, given = out / REQUEST, msgspec.json.encode(asdict(trial))
    if path.is_file():
        if msgspec.json.decode(path.read_bytes(), type=LiveTrial) != trial:
            msg = f"{out}: holds another trial, see {REQUEST}; give another --out"
            raise RecordingError(msg)
        return
    if (out / labels.SEALED).exists():
        raise RecordingError(f"{out}: holds a trial already; give another --out")
    for request in trial.requests():
        scene, rng = scene_of(request)
        reality("scenes").seal_scene(out, request.title, scene, CAR, rng)
    path.write_bytes(msgspec.json.format(given))


def _file(out: Path, request: CityRequest) -> Path:
    return out / FOUND / request.title / FOUND_FILE


def _judge(trial: LiveTrial, out: Path, seals: dict[str, str]) -> list[str]:
    judged = Judged()
    for request in trial.requests():
        path = _file(out, request)
        if not path.is_file():
            raise RecordingError(f"{path}: missing: this city was not played to its end")
        label = labels.opened(out, request.title, seals[request.title])
        found = msgspec.json.decode(path.read_bytes(), type=CityFound)
        judge_city(request.title, label, found, judged)
    result = msgspec.json.format(msgspec.json.encode(judged), indent=1)
    (out / RESULT).write_bytes(result)
    rows = [*lines(judged), "", *each(judged)]
    (out / TABLE).write_text("\n".join(rows) + "\n", encoding="utf-8")
    return rows
