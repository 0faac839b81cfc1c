"""Looks for the case that breaks it: Optuna chooses the factors of each next case.

A search learns where the measure gets worse and looks there more often. Its cases have rows like
those of a study. By default its memory is a journal in the results' folder, for one command at a
time; several commands share a search through a PostgreSQL database, where trials of a killed one
are noticed by their missing heartbeat and run again.
"""

import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import optuna
from optuna.storages import (
    BaseStorage,
    JournalStorage,
    RDBStorage,
    RetryHeartbeatStaleTrialCallback,
)
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, Trial, TrialState

from scm.errors import StudyError
from scm.study.case_process import Task
from scm.study.design import hashed, value_at
from scm.study.engine import Engine
from scm.study.results import Results
from scm.study.row import Row
from scm.study.study_file import Search, Value
from scm.study.tables import values_text, varied
from scm.study.targets import Axis

JOURNAL = "search.journal"
FIRST = 20  # cases drawn at random before the model of good and bad ones begins
EDGE = 1e-6  # a normal distribution has no outermost value
HEARTBEAT_S, GRACE_S, MAX_RETRIES = 30, 90, 3


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found.

    Attributes:
        worst: The row with the worst value so far; None: no case ended.
        cases: How many ran, in all.
        is_beyond: Whether the worst is beyond the file's `stop_below` or `stop_above`.
    """

    worst: Row | None
    cases: int
    is_beyond: bool


def run_search(
    results: Results, engine: Engine, on_row: Callable[[Row], None], storage: str = ""
) -> Found:
    """Run cases until one goes beyond the limit, or as many as the file says.

    Args:
        results: Where rows go; the cases of all commands that share a storage count.
        engine: Where cases run.
        on_row: Called with each new row.
        storage: URL of a PostgreSQL database; empty: a journal in the results' folder.

    Raises:
        StudyError: when the file says nothing of a search.
    """
    goal = results.study.file.study.search
    if goal is None:
        path = results.folder / "study.toml"
        raise StudyError(f"{path}: search: missing; expected [search] with measure and goal")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)  # three of its options
    with _opened(results.folder, storage) as opened:
        _search(results, engine, on_row, goal, _optuna_study(results, goal, opened))
    results.finish(state="complete", why="the search has ended")
    return worst_of(results, goal)


def _search(
    results: Results,
    engine: Engine,
    on_row: Callable[[Row], None],
    goal: Search,
    study: optuna.Study,
) -> None:
    """Run the cases that are left."""
    lock = threading.Lock()

    def objective(trial: Trial) -> float:
        values = _suggested(trial, results.study.design.axes)
        row = next(iter(engine.run([Task(case=trial.number, values=values)])))
        with lock:
            results.add(row)
            on_row(row)
        if not row.has_ended:
            raise optuna.TrialPruned
        return row.measures[goal.measure]

    def stop_beyond(study: optuna.Study, trial: FrozenTrial) -> None:
        if trial.value is not None and _is_beyond(trial.value, goal):
            study.stop()

    ended = (TrialState.COMPLETE, TrialState.PRUNED)
    left = goal.cases - len(study.get_trials(deepcopy=False, states=ended))
    if left > 0 and not worst_of(results, goal).is_beyond:
        enough = optuna.study.MaxTrialsCallback(goal.cases, states=ended)
        jobs = min(left, engine.cores)
        study.optimize(objective, left, n_jobs=jobs, callbacks=[stop_beyond, enough])


def worst_of(results: Results, goal: Search) -> Found:
    """Return the worst row that is there."""
    ended = [row for row in results.rows.values() if row.has_ended]
    sign = 1.0 if goal.goal == "minimize" else -1.0
    worst = min(ended, key=lambda row: (sign * row.measures[goal.measure], row.case), default=None)
    is_beyond = worst is not None and _is_beyond(worst.measures[goal.measure], goal)
    return Found(worst, len(results.rows), is_beyond)


def found_lines(results: Results, found: Found) -> Iterator[str]:
    """Yield what a search found."""
    goal = results.study.file.study.search
    if found.worst is None or goal is None:
        yield f"{found.cases} cases, and none of them ended"
        return
    unit = results.study.file.measures[goal.measure].unit
    value = found.worst.measures[goal.measure]
    beyond = ", beyond the limit" if found.is_beyond else ""
    yield f"{found.cases} cases; the worst is case {found.worst.case}:"
    factors = values_text(found.worst, varied(results))
    yield f"  {goal.measure} {value:.4g} {unit}{beyond}; {factors}"
    yield f"  scm study replay {results.folder} {found.worst.case}"
    yield f"  scm study show {results.folder} --html"


def _is_beyond(value: float, goal: Search) -> bool:
    below = goal.stop_below is not None and value < goal.stop_below
    return below or (goal.stop_above is not None and value > goal.stop_above)


def _optuna_study(results: Results, goal: Search, storage: BaseStorage) -> optuna.Study:
    name = results.study.file.name
    sampler = optuna.samplers.TPESampler(
        seed=hashed(f"{results.study.file.study.seed}/{name}/search") % 2**32,
        n_startup_trials=FIRST,
        multivariate=True,
        group=True,
        constant_liar=True,  # cases that run at the same time do not all look at one place
    )
    study = optuna.create_study(
        storage=storage, sampler=sampler, study_name=name, direction=goal.goal, load_if_exists=True
    )
    if not isinstance(storage, RDBStorage):
        _run_again(study)
    return study


@contextmanager
def _opened(folder: Path, url: str) -> Iterator[BaseStorage]:
    """Open a database, or else the journal of a folder."""
    if not url:
        yield JournalStorage(JournalFileBackend(str(folder / JOURNAL)))
        return
    scheme, _, rest = url.partition("://")
    if scheme not in {"postgresql", "postgres"}:
        raise StudyError(f"--storage: expected postgresql://..., got {url!r}")
    storage = RDBStorage(
        f"postgresql+psycopg://{rest}",
        heartbeat_interval=HEARTBEAT_S,
        grace_period=GRACE_S,
        heartbeat_stale_trial_callback=RetryHeartbeatStaleTrialCallback(MAX_RETRIES),
    )
    try:
        yield storage
    finally:
        storage.remove_session()
        storage.engine.dispose()


def _run_again(study: optuna.Study) -> None:
    """Queue once more the cases that a killed command had begun: the journal is its own."""
    for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        study.tell(trial.number, state=TrialState.FAIL)
        if trial.params:
            study.enqueue_trial(trial.params)


def _suggested(trial: Trial, axes: tuple[Axis, ...]) -> dict[str, Value]:
    """Return the factors of the next case; of drawn ones the share of draws below is chosen."""
    values: dict[str, Value] = {}
    for axis in axes:
        factor, levels = axis.factor, axis.factor.levels
        if factor.is_drawn:
            values[axis.path] = value_at(axis, trial.suggest_float(axis.path, EDGE, 1.0 - EDGE))
        elif factor.grid is not None:
            values[axis.path] = levels[trial.suggest_int(axis.path, 0, len(levels) - 1)]
        else:
            values[axis.path] = levels[levels.index(trial.suggest_categorical(axis.path, levels))]
    return values
