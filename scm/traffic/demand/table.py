"""Who wants to drive from where to where: tables as TOML or CSV, and SUMO's route files.

TOML (`[[flow]]`) and CSV have the same columns:

    from, to            a lane, a spawn place (from) or an edge: all lanes `<edge>_<number>`
    vehicles_per_hour   how many want to set out, at random times (Poisson)
    begin, end          time of day, `07:30` or seconds; default: the whole day
    car                 the car file's name; default nigel
    seed                of the random times; default 0
"""

import csv
import io
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from scm.errors import DemandError, nearest, reading
from scm.traffic.demand.sumo_routes import (
    DAY_S,
    DEFAULT_CAR,
    HOUR_S,
    Departures,
    number_of,
    read_routes,
)

MAX_TIME_S = 7.0 * DAY_S
COLUMNS = ("from", "to", "vehicles_per_hour", "begin", "end", "car", "seed")


@dataclass(frozen=True, slots=True)
class Flow:
    """One row: cars that want to go the same way.

    Attributes:
        begin_s: Time of day of the first, `end_s` of the last.
        departures_s: Their very times of day; None: by the rate, at random.
        via: Lanes or edges to pass on the way, in this order.
        name: What the row is called in its file; empty: by its number.
    """

    start: str
    end: str
    per_hour: float
    begin_s: float = 0.0
    end_s: float = DAY_S
    car: str = DEFAULT_CAR
    seed: int = 0
    departures_s: tuple[float, ...] | None = None
    via: tuple[str, ...] = ()
    name: str = ""


def departures(flow: Flow, number: int, from_s: float) -> tuple[float, ...]:
    """Return the times of day at which the cars of row `number` want to set out, from a time on.

    The draw begins with the row, so a city that starts later has the same cars from then on.
    """
    if flow.departures_s is not None:
        return tuple(t for t in sorted(flow.departures_s) if t >= from_s)
    rate = flow.per_hour / HOUR_S
    random = Random(f"{flow.seed}/{number}")
    found, at_s = [], flow.begin_s
    while rate > 0.0:
        at_s += random.expovariate(rate)
        if at_s >= flow.end_s:
            break
        if at_s >= from_s:
            found.append(at_s)
    return tuple(found)


def load_demand(path: Path, warn: Callable[[str], None] = lambda _: None) -> tuple[Flow, ...]:
    """Return the rows of a demand file: `.toml`, `.csv`, or SUMO's `.rou.xml`.

    Args:
        path: Of the file.
        warn: Called with what a SUMO file says and has no effect here.

    Raises:
        DemandError: naming file, row and key that are wrong.
    """
    if path.suffix == ".xml":
        return _nonempty([_flow_of(row) for row in read_routes(path, warn)], path)
    with reading(path, "a demand file", DemandError):
        text = path.read_text(encoding="utf-8")
    if path.suffix == ".toml":
        flows = [_flow(row, f"{path}: flow[{n}]") for n, row in enumerate(_toml(text, path))]
    elif path.suffix == ".csv":
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
        flows = [_flow(row, f"{path}: line {n}") for n, row in enumerate(rows, start=2)]
    else:
        raise DemandError(f"{path}: expected .toml, .csv or .rou.xml, got {path.suffix or path}")
    return _nonempty(flows, path)


def _nonempty(flows: Sequence[Flow], path: Path) -> tuple[Flow, ...]:
    if not flows:
        raise DemandError(f"{path}: expected at least one row, got none")
    return tuple(flows)


def _flow_of(row: Departures) -> Flow:
    """Return the row for cars of a SUMO file."""
    return Flow(
        start=row.way.start,
        end=row.way.end,
        per_hour=0.0,
        begin_s=min(row.at_s),
        end_s=max(row.at_s) + 1.0,
        car=row.car,
        departures_s=row.at_s,
        via=row.way.via,
        name=row.name,
    )


def _toml(text: str, path: Path) -> list[Mapping[str, Any]]:
    with reading(path, "a TOML file", DemandError):
        data = tomllib.loads(text)
    rows = data.get("flow", [])
    if not isinstance(rows, list) or set(data) - {"flow"}:
        raise DemandError(f"{path}: expected tables [[flow]] alone, got {', '.join(data)}")
    return rows


def _flow(row: Mapping[str, Any], where: str) -> Flow:
    given = {key: value for key, value in row.items() if value not in (None, "")}
    for key in given:
        if key not in COLUMNS:
            hint = nearest(str(key), COLUMNS)
            raise DemandError(f"{where}: no key {key!r}{hint}, only {', '.join(COLUMNS)}")
    for key in COLUMNS[:3]:
        if key not in given:
            raise DemandError(f"{where}: key {key!r} is missing")
    flow = Flow(
        start=str(given["from"]),
        end=str(given["to"]),
        per_hour=number_of(given["vehicles_per_hour"], f"{where}: vehicles_per_hour"),
        begin_s=seconds_of_day(given.get("begin", 0.0), f"{where}: begin"),
        end_s=seconds_of_day(given.get("end", DAY_S), f"{where}: end"),
        car=str(given.get("car", DEFAULT_CAR)),
        seed=int(number_of(given.get("seed", 0), f"{where}: seed")),
    )
    return _checked(flow, where)


def _checked(flow: Flow, where: str) -> Flow:
    if flow.begin_s >= flow.end_s:
        raise DemandError(f"{where}: end: expected after begin = {flow.begin_s:g} s")
    if flow.end_s > MAX_TIME_S:
        raise DemandError(
            f"{where}: end: expected at most {MAX_TIME_S:g} s, a week, got {flow.end_s:g}"
        )
    if flow.per_hour > HOUR_S:
        raise DemandError(f"{where}: expected at most {HOUR_S:g} an hour, got {flow.per_hour:g}")
    return flow


def seconds_of_day(given: object, where: str) -> float:
    """Return a time of day in seconds, from `07:30`, `07:30:15` or a number of seconds.

    Raises:
        DemandError: it is neither.
    """
    text = str(given)
    wrong = f"{where}: expected 07:30, 07:30:15 or seconds of the day, got {text!r}"
    parts = text.split(":")
    if len(parts) == 1:
        try:
            return number_of(given, where)
        except DemandError as error:
            raise DemandError(wrong) from error
    if len(parts) > 3 or not all(part.isdecimal() for part in parts):
        raise DemandError(wrong)
    hours, minutes, seconds = (int(part) for part in (*parts, "0")[:3])
    if hours > 24 or minutes > 59 or seconds > 59:
        raise DemandError(wrong)
    return float(hours * 3600 + minutes * 60 + seconds)
