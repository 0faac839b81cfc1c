"""A diagnosis of several cars: each by itself, then what they have in common."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from msgspec import structs
from threadpoolctl import threadpool_limits

from scm.clock import Clock, WallClock, seconds
from scm.errors import RecordingError, ScmError
from scm.mismatch.budget import DEFAULT_S, Budget
from scm.mismatch.discovery.decide import TIE
from scm.mismatch.effect_catalogue import identifications
from scm.mismatch.findings import Effect, Undecided, Verdict
from scm.mismatch.pipeline import diagnose_car, write
from scm.mismatch.report.cars_page import write_several
from scm.mismatch.select.round import Notify
from scm.mismatch.several.findings import Agreement, Common, all_alike
from scm.mismatch.several.shared_effects import compared
from scm.mismatch.validate.conclude import Result, conclude
from scm.mismatch.validate.explain import sentence_of
from scm.recorder.drives import SUFFIX, recordings_of
from scm.recording.read import Recording
from scm.vehicles.car import load_car

Turn = Callable[[str, int, int], None]
TOGETHER = "all cars"


@dataclass(frozen=True, slots=True)
class Several:
    """What was found of several cars.

    Attributes:
        cars: By name, which is also that of the folder of its report.
        common: Effects of what the cars share.
        failed: Why a car could not be diagnosed, a sentence each.
    """

    cars: Mapping[str, Result]
    common: tuple[Common, ...]
    runtime_s: float
    failed: tuple[str, ...] = ()


def cars_of(
    paths: Sequence[Path | str],
    data: Path | None = None,
    vehicle: str | None = None,
    warn: Notify = lambda _: None,
) -> dict[str, list[Recording]]:
    """Return the recordings of each car by a name for it, in the order of the recordings.

    In descriptions one `vehicle:` is one car; in runs of a city a car is who the city says. Where
    nothing given holds several cars and all name one car file, they are of one car. `warn` gets the
    reason why a car of a run is left out.

    Raises:
        RecordingError: when there is nothing to read.
    """
    grouped: dict[tuple[str, str], list[Recording]] = {}
    read = [(path, recordings_of(path, data, vehicle, warn)) for path in paths]
    every = [recording for _, recordings in read for recording in recordings]
    if len(every) == len(read) and len({recording.vehicle for recording in every}) == 1:
        return {every[0].name or Path(every[0].vehicle).stem: every}
    for path, recordings in read:
        for recording in recordings:
            is_run = Path(path).suffix == SUFFIX
            name = recording.name if is_run else Path(recording.vehicle).stem
            grouped.setdefault((name, recording.vehicle), []).append(recording)
    found: dict[str, list[Recording]] = {}
    for (name, _), together in grouped.items():
        number, free = 2, name
        while free in found:  # two files of one name are two cars
            free, number = f"{name}_{number}", number + 1
        found[free] = together
    return found


def with_played(
    cars: Mapping[str, list[Recording]], played: Sequence[Path | str]
) -> dict[str, list[Recording]]:
    """Return the recordings with drives that `scm play` recorded of the same car since.

    Raises:
        RecordingError: when they cannot be read, or there are several cars that they may be of.
    """
    if played and len(cars) != 1:
        msg = f"{played[0]}: a drive of one of {', '.join(cars)}; say of which with --vehicle"
        raise RecordingError(msg)
    more = [recording for path in played for recording in recordings_of(path)]
    return {name: [*recordings, *more] for name, recordings in cars.items()}


def diagnose_one(
    recordings: Sequence[Recording],
    *,
    budget_s: float = DEFAULT_S,
    budget: Budget | None = None,
    strict: bool = False,
    notify: Notify = lambda _: None,
    clock: Clock | None = None,
) -> Result:
    """Return what a simulator lacks to explain one car, by the file that its recordings name.

    Arguments are those of `diagnose`; a `budget` that began with the reading replaces `budget_s`.

    Raises:
        ScmError: when a recording or the car file cannot be used.
    """
    car = load_car(recordings[0].vehicle, trusted=False)
    return diagnose_car(
        recordings,
        car,
        budget=budget or Budget(budget_s, clock or WallClock()),
        strict=strict,
        notify=notify,
    )


def diagnose_several(
    cars: Mapping[str, Sequence[Recording]],
    *,
    budget_s: float = DEFAULT_S,
    strict: bool = False,
    notify: Notify = lambda _: None,
    turn: Turn = lambda *_: None,
    clock: Clock | None = None,
    executor: Executor | None = None,
) -> Several:
    """Return what a simulator lacks to explain each of several cars, and what they share.

    Arguments are those of `diagnose`, with recordings by car as `cars_of` returns them, and a
    budget for each. `turn` receives which car is next, its number, and of how many. An `executor`
    runs a task a car; its processes see the folders of recordings and car files.

    Raises:
        ScmError: when no car's recording or file can be used.
    """
    clock = clock or WallClock()
    began_ns, turns, found = clock.now_ns(), len(cars) + 1, dict[str, Result]()
    failed = list[str]()
    work = partial(diagnose_one, budget_s=budget_s, strict=strict)
    if executor is None:
        work = partial(work, notify=notify, clock=clock)
        results = {name: partial(work, recordings) for name, recordings in cars.items()}
    else:
        futures = {name: executor.submit(work, recordings) for name, recordings in cars.items()}
        results = {name: partial(_result_of, future) for name, future in futures.items()}
    for number, (name, result) in enumerate(results.items()):
        turn(name, number, turns)
        try:
            found[name] = result()
        except ScmError as error:
            failed.append(f"{name}: {error}")
    if not found:
        raise RecordingError("\n".join(failed))
    turn(TOGETHER, len(cars), turns)
    searches = {name: one.selected for name, one in found.items() if one.selected is not None}
    common = list[Common]()
    if len(searches) > 1:
        with threadpool_limits(1):
            common, adopted = compared(searches, notify)
            changed = {n: one for n, one in adopted.items() if one is not searches[n]}
            anew = {name: conclude(one, notify) for name, one in changed.items()}
            for name, one in anew.items():
                found[name] = _sharing(name, found[name], one, common, anew)
    return Several(found, tuple(common), seconds(clock.now_ns() - began_ns), tuple(failed))


def _result_of(future: Future[Result]) -> Result:
    """Return a diagnosis that another process made, with the cars that it wrote."""
    result = future.result()
    if result.files is None:
        return result
    written = (result.files.reread(car) for car in (result.found_car, result.retuned_car))
    found_car, retuned_car = written
    stages = tuple(
        replace(stage, car=result.files.reread(stage.car) or stage.car) for stage in result.stages
    )
    return replace(result, found_car=found_car, retuned_car=retuned_car, stages=stages)


def write_all(several: Several, out: Path, check: Callable[[str], str] = lambda _: "") -> None:
    """Write each car's report into its folder, and the page and `cars.json` of them all.

    `check` gives, by a car's name, the command that computes its figures again.

    Raises:
        ScmError: when a folder cannot be written.
    """
    for name, found in several.cars.items():
        write(found, out / name, check(name))
    diagnoses = {name: found.diagnosis for name, found in several.cars.items()}
    recordings = {name: found.evidence.recordings for name, found in several.cars.items()}
    write_several(diagnoses, recordings, several.common, several.runtime_s, out,
                  several.failed)  # fmt: skip


def _sharing(
    name: str, found: Result, anew: Result, common: Sequence[Common], all_anew: Mapping[str, Result]
) -> Result:
    """Return a car's diagnosis with the effects that it shares, at the shared estimates."""
    shared = {c.name: c for c in common if c.shared and _sees(c, name)}
    effects = tuple(
        _with_shared(effect, shared[effect.name], name, all_anew)
        if effect.name in shared
        else effect
        for effect in anew.diagnosis.effects
    )
    suggestions = tuple(
        s for s in anew.suggestions if not _is_decided(s.undecided, shared, all_anew)
    )
    undecided = tuple(s.undecided for s in suggestions)
    verdict = Verdict.UNDECIDED if undecided else anew.diagnosis.verdict
    if anew.diagnosis.undecided and not undecided:
        verdict = Verdict.MISMATCH
    diagnosis = structs.replace(
        anew.diagnosis, verdict=verdict, effects=effects, undecided=undecided,
        data=found.diagnosis.data, runtime_s=found.diagnosis.runtime_s,
    )  # fmt: skip
    return replace(anew, diagnosis=diagnosis, suggestions=suggestions)


def _is_decided(
    question: Undecided, shared: Mapping[str, Common], all_anew: Mapping[str, Result]
) -> bool:
    """Return whether all cars together answer what one leaves open.

    That each has an effect of its own that looks alike would be chance; of effects of what they
    share, the one found must explain their recordings better by as much as one car's would have to.
    """
    mine = next((name for name in question.between if name in shared), None)
    if mine is None:
        return False
    seeing = [one for name, one in all_anew.items() if _sees(shared[mine], name)]
    others = [name for name in question.between if name not in shared and is_shareable(name)]
    return all(sum(_ahead(one, mine, other) for one in seeing) > TIE for other in others)


def is_shareable(name: str) -> bool:
    """Return whether an effect of the catalogue may come from what several cars share."""
    known = identifications().get(name)
    return known is not None and bool(known.shared)


def _ahead(found: Result, name: str, other: str) -> float:
    """Return how much better an effect explains a car's recordings than another in its place."""
    for one in found.selected.selection.rounds if found.selected is not None else ():
        names = [fitted.names[-1] for fitted in one.alternatives]
        best = dict(zip(names[::-1], one.criteria[::-1], strict=True))  # the first, best, stays
        if name in best:
            return best.get(other, max(one.criteria)) - best[name]
    return 0.0


def _sees(common: Common, name: str) -> bool:
    return any(
        c.car == name and c.agreement in (Agreement.CONFIRMS, Agreement.SUPPORTS)
        for c in common.cars
    )


def _with_shared(
    effect: Effect, common: Common, name: str, all_anew: Mapping[str, Result]
) -> Effect:
    """Return an effect as all cars together show it, as sure as the surest of them is."""
    best = all_anew[name].best
    if set(effect.parameters) != set(common.parameters) or best is None:
        return effect
    estimates = {key: common.parameters[key] for key in effect.parameters}
    candidate = next(e for e in best.effects if e.name == effect.name)
    every = [e for one in all_anew.values() for e in one.diagnosis.effects]
    return structs.replace(
        effect,
        parameters=estimates,
        probability=max(e.probability for e in every if e.name == effect.name),
        text=f"{sentence_of(candidate, estimates)} {all_alike(common, name)}",
    )
