"""Who wants to drive from where to where: tables as TOML or CSV, and SUMO's flows and trips.

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
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any
from xml.etree import ElementTree

from scm.errors import ScmError, nearest, reading

DAY_S = 86_400.0
DEFAULT_CAR = "nigel"
COLUMNS = ("from", "to", "vehicles_per_hour", "begin", "end", "car", "seed")
HOUR_S = 3600.0


class DemandError(ScmError, ValueError):
    """A demand table that cannot be."""


@dataclass(frozen=True, slots=True)
class Flow:
    """One row: cars that want to go the same way.

    Attributes:
        begin_s: Time of day of the first, `end_s` of the last.
        even: Whether they come at equal intervals, not at random.
        departures_s: Their very times of day; empty: by the rate.
    """

    start: str
    end: str
    per_hour: float
    begin_s: float = 0.0
    end_s: float = DAY_S
    car: str = DEFAULT_CAR
    seed: int = 0
    even: bool = False
    departures_s: tuple[float, ...] = ()


def departures(flow: Flow, number: int, from_s: float) -> tuple[float, ...]:
    """Return the times of day at which the cars of row `number` want to set out, from a time on.

    The draw begins with the row, so a city that starts later has the same cars from then on.
    """
    if flow.departures_s:
        return tuple(t for t in sorted(flow.departures_s) if t >= from_s)
    rate = flow.per_hour / HOUR_S
    random = Random(f"{flow.seed}/{number}")
    found, at_s = [], flow.begin_s
    while rate > 0.0:
        if not flow.even:
            at_s += random.expovariate(rate)
        if at_s >= flow.end_s:
            break
        if at_s >= from_s:
            found.append(at_s)
        if flow.even:
            at_s += 1.0 / rate
    return tuple(found)


def load_demand(path: Path) -> tuple[Flow, ...]:
    """Return the rows of a demand file: `.toml`, `.csv`, or SUMO's `.rou.xml`.

    Raises:
        DemandError: naming file, row and key that are wrong.
    """
    with reading(path, "a demand file", DemandError):
        text = path.read_text(encoding="utf-8")
    if path.suffix == ".xml":
        flows = _of_sumo(text, path)
    elif path.suffix == ".toml":
        flows = [_flow(row, f"{path}: flow[{n}]") for n, row in enumerate(_toml(text, path))]
    elif path.suffix == ".csv":
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
        flows = [_flow(row, f"{path}: line {n}") for n, row in enumerate(rows, start=2)]
    else:
        raise DemandError(f"{path}: expected .toml, .csv or .rou.xml, got {path.suffix or path}")
    if not flows:
        raise DemandError(f"{path}: expected at least one row, got none")
    return tuple(flows)


def _toml(text: str, path: Path) -> list[Mapping[str, Any]]:
    with reading(path, "a TOML file", DemandError):
        data = tomllib.loads(text)
    rows = data.get("flow", [])
    if not isinstance(rows, list) or set(data) - {"flow"}:
        raise DemandError(f"{path}: expected tables [[flow]] alone, got {', '.join(data)}")
    return rows


def _flow(row: Mapping[str, Any], where: str) -> Flow:
    told = {key: value for key, value in row.items() if value not in (None, "")}
    for key in told:
        if key not in COLUMNS:
            hint = nearest(str(key), COLUMNS)
            raise DemandError(f"{where}: no key {key!r}{hint}, only {', '.join(COLUMNS)}")
    for key in COLUMNS[:3]:
        if key not in told:
            raise DemandError(f"{where}: key {key!r} is missing")
    flow = Flow(
        start=str(told["from"]),
        end=str(told["to"]),
        per_hour=_number(told["vehicles_per_hour"], f"{where}: vehicles_per_hour"),
        begin_s=seconds_of_day(told.get("begin", 0.0), f"{where}: begin"),
        end_s=seconds_of_day(told.get("end", DAY_S), f"{where}: end"),
        car=str(told.get("car", DEFAULT_CAR)),
        seed=int(_number(told.get("seed", 0), f"{where}: seed")),
    )
    return _checked(flow, where)


def _checked(flow: Flow, where: str) -> Flow:
    if flow.begin_s >= flow.end_s:
        raise DemandError(f"{where}: end: expected after begin = {flow.begin_s:g} s")
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
            return _number(given, where)
        except DemandError as error:
            raise DemandError(wrong) from error
    if len(parts) > 3 or not all(part.isdecimal() for part in parts):
        raise DemandError(wrong)
    hours, minutes, seconds = (int(part) for part in (*parts, "0")[:3])
    if hours > 24 or minutes > 59 or seconds > 59:
        raise DemandError(wrong)
    return float(hours * 3600 + minutes * 60 + seconds)


def _number(given: object, where: str) -> float:
    try:
        value = float(str(given))
    except ValueError as error:
        raise DemandError(f"{where}: expected a number, got {given!r}") from error
    if not 0.0 <= value < float("inf"):
        raise DemandError(f"{where}: expected 0 or more, got {given!r}")
    return value


def _of_sumo(text: str, path: Path) -> list[Flow]:
    """Return the flows, trips and vehicles of a SUMO route file; only ends of routes are read."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise DemandError(f"{path}: cannot be read as XML: {error}") from error
    routes = {r.get("id", ""): r.get("edges", "") for r in root.iter("route")}
    found = []
    for entry in root:
        if entry.tag in ("flow", "trip", "vehicle"):
            where = f"{path}: {entry.tag} {entry.get('id', '?')}"
            found.append(_checked(_sumo_flow(entry, routes, where), where))
    return found


def _sumo_flow(entry: ElementTree.Element, routes: Mapping[str, str], where: str) -> Flow:
    start, end = _ends(entry, routes, where)
    if entry.tag != "flow":
        depart = _number(entry.get("depart"), f"{where}: depart")
        return Flow(start, end, 0.0, depart, depart + 1.0, departures_s=(depart,))
    begin = _number(entry.get("begin", "0"), f"{where}: begin")
    finish = _number(entry.get("end", str(DAY_S)), f"{where}: end")
    count = entry.get("number")
    if (rate := entry.get("vehsPerHour")) is not None:
        per_hour = _number(rate, f"{where}: vehsPerHour")
    elif (period := entry.get("period")) is not None:
        per_hour = HOUR_S / max(_number(period, f"{where}: period"), 1e-9)
    elif (chance := entry.get("probability")) is not None:
        per_hour = HOUR_S * _number(chance, f"{where}: probability")
    elif count is not None and finish > begin:
        per_hour = HOUR_S * _number(count, f"{where}: number") / (finish - begin)
    else:
        raise DemandError(f"{where}: expected vehsPerHour, period, probability or number")
    even = entry.get("probability") is None
    return Flow(start, end, per_hour, begin, finish, even=even)


def _ends(
    entry: ElementTree.Element, routes: Mapping[str, str], where: str
) -> tuple[str, str]:  # fmt: skip
    """Return the first and the last edge of an entry's way."""
    start, end = entry.get("from"), entry.get("to")
    if start and end:
        return start, end
    own = entry.find("route")
    edges = own.get("edges", "") if own is not None else routes.get(entry.get("route", ""), "")
    named = edges.split()
    if not named:
        raise DemandError(f"{where}: expected from and to, or a route with edges")
    return named[0], named[-1]
