"""What a factor varies: a number of the map, of a car file, of the network, or an argument.

    walls.*.yaw_rad                     each wall, turned about its middle by so much
    spawns.a.x_m                        where the car of spawn place `a` starts
    cars.nigel.tyre.slip_extremum       a number of a car file; of an effect that it lacks, too
    radio.loss, junctions.crossing.plan, lights.3.yaw_rad, cameras.ceiling.tilt_x_rad, ...
    network.drop                        messages lost between parts, see `scm.v2x.faults`
    daylight.azimuth                    of cars' cameras, see `scm.camera.daylight`
    policy                              an argument of the scenario

A unit at the end may be left out where only one fits: `walls.*.yaw`.
"""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import msgspec

from scm.camera.daylight import Daylight
from scm.errors import CarError, ScmError, StudyError, nearest
from scm.geometry import wrap_angle
from scm.maps.check import problems_of
from scm.maps.load import load_map
from scm.maps.route import roads_of
from scm.records.city_map import CityMap, Spawn, Wall
from scm.study.study_file import Apply, Factor, StudyFile, Value
from scm.v2x.faults import FaultRates
from scm.vehicles.car import Car, all_terms, car_names, load_car
from scm.vehicles.term import Term

CARS = "cars"
POSE = ("x_m", "y_m", "yaw_rad")
DEFAULT_CAR = "nigel"
UNBOUNDED = (-math.inf, math.inf)
_SETTINGS: dict[str, Any] = {"network": FaultRates, "daylight": Daylight}


@dataclass(frozen=True, slots=True)
class Setting:
    """All that factors may vary, as a scenario finds it.

    Attributes:
        cars: Varied car files, by name; all others are as they are.
        arguments: Of the scenario.
    """

    city_map: CityMap
    cars: Mapping[str, Car] = field(default_factory=dict)
    network: FaultRates = field(default_factory=FaultRates)
    daylight: Daylight = field(default_factory=Daylight)
    arguments: Mapping[str, Value] = field(default_factory=dict)

    def car(self, name: str) -> Car:
        """Return a car, varied or not.

        Raises:
            CarError: when there is none of that name.
        """
        return self.cars[name] if name in self.cars else load_car(name)


@dataclass(frozen=True, slots=True)
class Target:
    """One thing that a factor sets.

    Attributes:
        path: Its complete path, without `*`.
        nominal: What the files say; None: nothing, as of an argument without a default.
        bounds: Lowest and highest number that is allowed.
        std: The standard deviation that the car file states; None: none.
        put: Returns a setting in which it has another value.
    """

    path: str
    nominal: Value | None
    put: Callable[[Setting, Value], Setting]
    bounds: tuple[float, float] = UNBOUNDED
    std: float | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """One column of the results: a factor, or one match of a factor with `each`.

    Attributes:
        key: Of the factor in the study file.
        targets: What it sets; of stored results nothing.
    """

    path: str
    key: str
    factor: Factor
    targets: tuple[Target, ...] = ()

    def put(self, setting: Setting, value: Value) -> Setting:
        """Return the setting with all targets set.

        Raises:
            StudyError: when a value does not fit.
        """
        for target in self.targets:
            setting = target.put(setting, _applied(self.factor.apply, target, value))
        return setting


def base_setting(file: StudyFile, city_map: str | CityMap) -> Setting:
    """Return the setting that a study's files describe.

    Args:
        file: Of the study.
        city_map: A map, or the name of one: shipped, or a file beside the study file.

    Raises:
        ScmError: when a map or a car file cannot be read.
    """
    cars = {Path(name).stem: load_car(file.folder / name) for name in file.study.cars}
    if isinstance(city_map, CityMap):
        return Setting(city_map, cars)
    beside = file.folder / city_map
    return Setting(load_map(beside if beside.is_file() else city_map), cars)


def axes_of(
    factors: Mapping[str, Factor], base: Setting, parameters: Mapping[str, inspect.Parameter]
) -> list[Axis]:
    """Return the columns that factors make, in the order of the file.

    Raises:
        StudyError: naming every path that leads nowhere, and every value that does not fit.
    """
    axes, problems = list[Axis](), list[str]()
    for path, factor in factors.items():
        try:
            targets = targets_of(path, base, parameters)
            if factor.each:
                axes += [Axis(one.path, path, factor, (one,)) for one in targets]
            else:
                complete = targets[0].path if len(targets) == 1 else _starred(path, targets)
                axes.append(Axis(complete, path, factor, tuple(targets)))
            problems += _misfits(path, factor, targets, base)
        except StudyError as cause:
            problems.append(str(cause))
    missing = [
        name
        for name, parameter in parameters.items()
        if parameter.default is inspect.Parameter.empty and name not in factors
    ]
    problems += [f"factors.{name}: the scenario needs it, got none" for name in missing]
    if problems:
        raise StudyError("\n".join(problems))
    return axes


def targets_of(
    path: str, base: Setting, parameters: Mapping[str, inspect.Parameter]
) -> list[Target]:
    """Return what a path means, several if it has a `*`.

    Raises:
        StudyError: when it leads nowhere.
    """
    steps = path.split(".")
    if len(steps) == 1 and (path in parameters or path not in CityMap.__struct_fields__):
        return [_argument(path, parameters)]
    if steps[0] == CARS:
        return list(_of_cars(path, steps[1:], base))
    if steps[0] in _SETTINGS:
        return [_of_settings(path, steps[0], ".".join(steps[1:]))]
    return list(_of_map(path, steps, base.city_map))


def checked_map(setting: Setting) -> Setting:
    """Return the setting; a map that factors made impossible is refused.

    Raises:
        StudyError: with every reason.
    """
    problems = problems_of(setting.city_map)
    if problems:
        raise StudyError("the factors make an impossible map: " + "; ".join(problems))
    return setting


def _applied(apply: Apply, target: Target, value: Value) -> Value:
    if apply == "set":
        return value
    if not _is_number(value) or not _is_number(target.nominal):
        msg = f"{target.path}: expected numbers to {apply}, got {target.nominal!r} and {value!r}"
        raise StudyError(msg)
    nominal, number = cast("float", target.nominal), cast("float", value)
    return nominal + number if apply == "add" else nominal * number


def _misfits(path: str, factor: Factor, targets: Sequence[Target], base: Setting) -> list[str]:
    """Return what is wrong with the values of a factor, tried one by one."""
    tried: list[Value] = list(factor.levels)
    for limits in (factor.uniform, factor.log_uniform):
        tried += limits or ()
    problems = []
    for target in targets:
        if factor.std is not None and target.std is None:
            problems.append(f"factors.{path}.std: {target.path} states no standard deviation")
        for value in tried:
            try:
                target.put(base, _applied(factor.apply, target, value))
            except StudyError as cause:
                problems.append(f"factors.{path}: {cause}")
    return list(dict.fromkeys(problems))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _starred(path: str, targets: Sequence[Target]) -> str:
    """Return a path with `*` whose last step is complete."""
    return ".".join([*path.split(".")[:-1], targets[0].path.rpartition(".")[2]])


def _argument(path: str, parameters: Mapping[str, inspect.Parameter]) -> Target:
    if path not in parameters:
        known = ", ".join(parameters) or "none"
        msg = (
            f"factors.{path}: the scenario has no such argument{nearest(path, list(parameters))}; "
            f"its arguments: {known}; other factors are paths, such as radio.loss"
        )
        raise StudyError(msg)
    default = parameters[path].default

    def put(setting: Setting, value: Value) -> Setting:
        return replace(setting, arguments={**setting.arguments, path: value})

    return Target(path, None if default is inspect.Parameter.empty else default, put)


def _of_settings(path: str, root: str, name: str) -> Target:
    """Return a number of the network's faults or of the daylight."""
    kind = _SETTINGS[root]
    name = _completed(path, name, list(kind.__dataclass_fields__))

    def put(setting: Setting, value: Value) -> Setting:
        if not _is_number(value):
            raise StudyError(f"{path}: expected a number, got {value!r}")
        try:
            new = replace(getattr(setting, root), **{name: float(value)})
        except ScmError as cause:
            raise StudyError(f"{path}: {cause}") from cause
        return replace(setting, **{root: new})

    bounds = (0.0, 1.0) if kind is FaultRates and name != "late_s" else UNBOUNDED
    return Target(f"{root}.{name}", getattr(kind(), name), put, bounds)


def _completed(path: str, name: str, known: Sequence[str]) -> str:
    """Return the known name that is meant: itself, or the only one with a unit behind it."""
    if name in known:
        return name
    longer = [one for one in known if one.startswith(f"{name}_")]
    if len(longer) == 1:
        return longer[0]
    several = f"; did you mean {' or '.join(longer)}?" if longer else nearest(name, list(known))
    msg = f"factors.{path}: no {name!r} there{several}"
    raise StudyError(msg)


def _of_cars(path: str, steps: Sequence[str], base: Setting) -> Iterator[Target]:
    """Yield a number of one car file, or of all that the study names."""
    if len(steps) not in {3, 4}:
        msg = f"factors.{path}: expected cars.CAR.SECTION.KEY, as cars.nigel.body.mass_kg"
        raise StudyError(msg)
    name, section, key = steps[:3]
    names = [*base.cars, *car_names()]
    if name == "*":
        chosen = list(base.cars) or [DEFAULT_CAR]
    elif name in names:
        chosen = [name]
    else:
        raise StudyError(f"factors.{path}: no car {name!r}{nearest(name, names)}")
    for one in chosen:
        yield _of_car(path, one, section, key, steps[3:], base)


def _of_car(
    path: str, name: str, section: str, key: str, index: Sequence[str], base: Setting
) -> Target:
    car = base.car(name)
    whole, effect = _key_of(path, car, section, key)
    if effect is not None:
        car = car.with_terms([effect])
    quantity = car.quantity(whole)
    nominal, at = quantity.value, None
    if index:
        at = _index_of(path, index[0], nominal)
        nominal = cast("tuple[float, ...]", nominal)[at]
    elif isinstance(nominal, tuple):
        msg = (
            f"factors.{path}: {len(nominal)} numbers, expected one of them: "
            f"{path}.0 to {path}.{len(nominal) - 1}"
        )
        raise StudyError(msg)

    def put(setting: Setting, value: Value) -> Setting:
        old = setting.car(name)
        if effect is not None and effect not in old.terms:
            old = old.with_terms([effect])
        given = value
        if at is not None:
            given = tuple(  # type: ignore[assignment]
                value if i == at else number for i, number in enumerate(old.vector(whole))
            )
        try:
            new = old.with_values({whole: given})
        except CarError as cause:
            raise StudyError(str(cause)) from cause
        return replace(setting, cars={**setting.cars, name: new})

    complete = ".".join([CARS, name, whole, *index])
    return Target(complete, nominal, put, car.bounds(whole), quantity.std)


def _index_of(path: str, text: str, nominal: object) -> int:
    count = len(nominal) if isinstance(nominal, tuple) else 0
    if not text.isdigit() or int(text) >= count:
        msg = f"factors.{path}: expected a number below {count} at its end, got {text!r}"
        raise StudyError(msg)
    return int(text)


def _key_of(path: str, car: Car, section: str, key: str) -> tuple[str, Term | None]:
    """Return a whole key of a car file, and the effect that has it if the car has none such.

    A section may also be the name of an effect: `steer_trim.trim_rad` is `steering.trim_rad`.
    """
    own = [known for known in car.values if known.startswith(f"{section}.")]
    lacking = {
        param.key: term
        for term in all_terms().values()
        for param in term.params
        if param.key not in car.values
        and (param.key.startswith(f"{section}.") or term.name == section)
    }
    named = [p.key for term in all_terms().values() if term.name == section for p in term.params]
    by_last = {known.partition(".")[2]: known for known in (*lacking, *named, *own)}
    if not by_last:
        sections = sorted({known.partition(".")[0] for known in car.values} | set(all_terms()))
        msg = f"factors.{path}: {car.name} has no section {section!r}{nearest(section, sections)}"
        raise StudyError(msg)
    whole = by_last[_completed(path, key, list(by_last))]
    return whole, lacking.get(whole)


def _of_map(path: str, steps: Sequence[str], city_map: CityMap) -> Iterator[Target]:
    """Yield numbers of the map; a `*` stands for all of a list."""
    for complete, ways in _ways(path, steps, city_map):
        *_, last = ways
        owner = _at(city_map, ways[:-1])
        if isinstance(owner, Wall | Spawn) and last in POSE:
            yield _pose_target(complete, ways, owner, city_map)
        else:
            yield _field_target(complete, ways, city_map)


Way = tuple[str | int, ...]


def _ways(path: str, steps: Sequence[str], value: Any) -> Iterator[tuple[str, Way]]:
    """Yield complete paths with the fields and indices that lead there."""
    if not steps:
        yield "", ()
        return
    step, *others = steps
    if isinstance(value, msgspec.Struct):
        fields = list(value.__struct_fields__)
        if isinstance(value, Wall | Spawn):
            fields += [name for name in POSE if name not in fields]
        name = _completed(path, step, fields)
        found: list[tuple[str, str | int]] = [(name, name)]
    elif isinstance(value, tuple):
        found = [(text, i) for i, text in _elements(path, step, value)]
    else:
        msg = f"factors.{path}: {step!r} leads nowhere: before it is {value!r}"
        raise StudyError(msg)
    for text, way in found:
        for rest, further in _ways(path, others, _step(value, way)):
            yield ".".join(filter(None, (text, rest))), (way, *further)


def _elements(path: str, step: str, values: tuple[Any, ...]) -> list[tuple[int, str]]:
    """Return the elements of a list that are meant, by name or by number."""
    names = [str(getattr(value, "name", i)) for i, value in enumerate(values)]
    if step == "*":
        if not values:
            raise StudyError(f"factors.{path}: the map has none of these")
        return list(enumerate(names))
    if step in names:
        return [(names.index(step), step)]
    if step.isdigit() and int(step) < len(values):
        return [(int(step), names[int(step)])]
    several = f"{', '.join(names[:8])}{', ...' * (len(names) > 8)}" or "none"
    msg = f"factors.{path}: no {step!r}{nearest(step, names)}; there are {several}"
    raise StudyError(msg)


def _step(value: Any, way: str | int) -> Any:
    if isinstance(way, int):
        return value[way]
    return getattr(value, way, None)  # None: a pose that the record has in another form


def _at(value: Any, ways: Way) -> Any:
    for way in ways:
        value = _step(value, way)
    return value


def _put_at(value: Any, ways: Way, new: Any) -> Any:
    """Return a record or list with another value at the end of a way."""
    if not ways:
        return new
    way, *others = ways
    changed = _put_at(_step(value, way), tuple(others), new)
    if isinstance(way, int):
        return (*value[:way], changed, *value[way + 1 :])
    return msgspec.structs.replace(value, **{way: changed})


def _field_target(complete: str, ways: Way, city_map: CityMap) -> Target:
    nominal = _at(city_map, ways)
    if isinstance(nominal, msgspec.Struct | tuple):
        raise StudyError(f"factors.{complete}: expected one value there, got several")
    kind = _type_of(city_map, ways)

    def put(setting: Setting, value: Value) -> Setting:
        try:
            checked = msgspec.convert(value, kind)
        except msgspec.ValidationError as cause:
            msg = f"{complete}: {str(cause).replace('`', '')}, value {value!r}"
            raise StudyError(msg) from cause
        return replace(setting, city_map=_put_at(setting.city_map, ways, checked))

    return Target(complete, nominal, put)


def _type_of(city_map: CityMap, ways: Way) -> Any:
    """Return the type of a field; that of a number within a list."""
    name = ways[-1]
    if isinstance(name, int):
        return float
    owner = _at(city_map, ways[:-1])
    return next(f.type for f in msgspec.structs.fields(owner) if f.name == name)


def _pose_target(complete: str, ways: Way, owner: Wall | Spawn, city_map: CityMap) -> Target:
    """Return one number of where a wall or a spawn place is; walls move from where they stand."""
    name = str(ways[-1])
    if isinstance(owner, Wall):
        nominal = 0.0
    else:
        nominal = roads_of(city_map).spawn_pose(owner.name)[POSE.index(name)]

    def put(setting: Setting, value: Value) -> Setting:
        if not _is_number(value):
            raise StudyError(f"{complete}: expected a number, got {value!r}")
        old = _at(setting.city_map, ways[:-1])
        if isinstance(old, Wall):
            new: Wall | Spawn = _moved(old, name, float(value))
        else:
            pose = [*roads_of(setting.city_map).spawn_pose(old.name)]
            pose[POSE.index(name)] = float(value)
            place = (pose[0], pose[1], wrap_angle(pose[2]))
            new = Spawn(name=old.name, pose=place)
        return replace(setting, city_map=_put_at(setting.city_map, ways[:-1], new))

    return Target(complete, nominal, put)


def _moved(wall: Wall, name: str, by: float) -> Wall:
    """Return a wall shifted along an axis, or turned about the mean of its points."""
    points = wall.points
    if name == "yaw_rad":
        x0 = sum(x for x, _ in points) / len(points)
        y0 = sum(y for _, y in points) / len(points)
        c, s = math.cos(by), math.sin(by)
        moved = [
            (x0 + c * (x - x0) - s * (y - y0), y0 + s * (x - x0) + c * (y - y0)) for x, y in points
        ]
    else:
        dx, dy = (by, 0.0) if name == "x_m" else (0.0, by)
        moved = [(x + dx, y + dy) for x, y in points]
    return msgspec.structs.replace(wall, points=tuple(moved))
