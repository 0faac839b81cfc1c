"""Names of tasks with their maps, as `driving_school/lap-v1`; Gymnasium's begin with `scm/`."""

import re
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from gymnasium.error import NameNotFound, UnregisteredEnv, VersionNotFound

from scm.errors import nearest
from scm.gym import tasks
from scm.gym.task import Task

PATTERN = re.compile(r"(?:scm/)?(?P<map>.+)[/-](?P<task>[a-z_]+)-v(?P<version>\d+)")


@cache
def all_tasks() -> dict[str, Task]:
    """Return all tasks by name."""
    modules = (
        import_module(f"{tasks.__name__}.{one.name}") for one in iter_modules(tasks.__path__)
    )
    return {module.TASK.name: module.TASK for module in modules}


def ids() -> list[str]:
    """Return the names under which Gymnasium knows the tasks."""
    return [
        f"scm/{map_name}-{task.name}-v{task.version}"
        for task in all_tasks().values()
        for map_name in task.maps
    ]


def task_of(name: str) -> tuple[Task, str]:
    """Return a task and the name of its map.

    Args:
        name: As in `ids`, or `MAP/TASK-vN`; the map may be another by name or path.

    Raises:
        gymnasium.error.Error: There is no such task, or not of that version.
    """
    found = PATTERN.fullmatch(name)
    if found is None:
        msg = f"{name!r}: expected a map, a task and its version, as in driving_school/lap-v1"
        raise UnregisteredEnv(msg)
    task = all_tasks().get(found["task"])
    if task is None:
        known = sorted(all_tasks())
        msg = f"{name}: no task {found['task']!r}{nearest(found['task'], known)}"
        raise NameNotFound(msg)
    if int(found["version"]) != task.version:
        msg = f"{name}: {task.name} has version {task.version}, not {found['version']}"
        raise VersionNotFound(msg)
    return task, found["map"]
