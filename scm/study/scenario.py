"""A scenario: a Python file with `run(case, ...)`, which drives one city and returns measures.

    MAP = "driving_school"                     # where it plays unless the study says otherwise

    def run(case, plan="calm", cars=2):
        with case.open_city() as city:
            ...
            return {"travel_time_s": 12.3}

`MAP` may be a `CityMap`, too. The other arguments of `run` are factors by their names. Shipped
scenarios are in `scm/study/scenarios`.
"""

import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from scm import registry
from scm.errors import StudyError, nearest
from scm.records.city_map import CityMap

SHIPPED = "scm.study.scenarios"
DEFAULT_MAP = "driving_school"


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario.

    Attributes:
        run: Called with a `scm.study.case.Case` and the arguments; returns measures by name.
        map: Where it plays unless the study says otherwise: a map, or the name of one.
        about: What it does, in one line.
        parameters: The arguments of `run` besides the case, by name.
    """

    run: Callable[..., Mapping[str, float]]
    map: str | CityMap
    about: str
    parameters: Mapping[str, inspect.Parameter]


def load_scenario(name: str, folder: Path) -> Scenario:
    """Return a shipped scenario by name, or that of a Python file in a study's folder.

    Raises:
        StudyError: when there is none, or it cannot be imported.
    """
    path = folder / name
    if path.suffix == ".py":
        return _scenario_of(_module_of(path), str(path))
    names = registry.names(SHIPPED)
    if name not in names:
        hint = nearest(name, names)
        msg = f"scenario: no {name!r}{hint}; expected a Python file or one of {', '.join(names)}"
        raise StudyError(msg)
    return _scenario_of(import_module(f"{SHIPPED}.{name}"), name)


def _module_of(path: Path) -> ModuleType:
    if not path.is_file():
        raise StudyError(f"scenario: {path}: there is no such file")
    name = f"scm_study_scenario_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise StudyError(f"scenario: {path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # as an import does: what pickles its classes looks there
    try:
        spec.loader.exec_module(module)
    except Exception as cause:
        msg = f"scenario: {path}: cannot be imported: {type(cause).__name__}: {cause}"
        raise StudyError(msg) from cause
    return module


def _scenario_of(module: ModuleType, where: str) -> Scenario:
    run = getattr(module, "run", None)
    if not callable(run):
        raise StudyError(f"scenario: {where}: expected a function run(case, ...), got none")
    parameters = dict(inspect.signature(run).parameters)
    if not parameters:
        raise StudyError(f"scenario: {where}: expected run(case, ...), got run()")
    del parameters[next(iter(parameters))]
    flexible = [n for n, p in parameters.items() if p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    for name in flexible:
        del parameters[name]
    about = (inspect.getdoc(module) or inspect.getdoc(run) or "").partition("\n")[0]
    return Scenario(run, getattr(module, "MAP", DEFAULT_MAP), about, parameters)
