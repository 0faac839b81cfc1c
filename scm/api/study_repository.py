"""The studies of a folder: how far each is, and what `scm study show` makes of one.

Rows of cases are never read here: of a long study that takes seconds and much memory. Nor is a
study's scenario imported: it is somebody else's code.
"""

import re
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import msgspec

from scm.api.city import not_found
from scm.api.folders import written_ns
from scm.api.operations import without_paths
from scm.api.problem import RefusedError
from scm.api.programs import run_scm
from scm.errors import RunError, ScmError
from scm.records.studies import Study, StudyRow

NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]{0,99}$"
PAGE, CASES = "study.html", "cases.parquet"
NEEDED = ("matplotlib", "pyarrow", "scipy")


class StudyRepository:
    """One folder of studies; None: there is none, and no study."""

    def __init__(self, root: Path | None) -> None:
        self._root = root
        self._complete: dict[str, tuple[int, StudyRow]] = {}

    def names(self) -> list[str]:
        """Return all studies, the one that was begun last first.

        Raises:
            RefusedError: when what reads them is not installed.
        """
        _check_installed()
        return [name for _, name in sorted(self._dated(), reverse=True)]

    def folder(self, name: str) -> Path:
        """Return the folder of a study.

        Raises:
            RefusedError: when there is none of that name, or what reads it is not installed.
        """
        _check_installed()
        if self._root is None or not re.fullmatch(NAME, name) or not (self._root / name).is_dir():
            raise not_found("study", name)
        return self._root / name

    def row(self, name: str) -> StudyRow:
        """Return how far a study is; one that cannot be read has the reason.

        Raises:
            RefusedError: when there is none of that name.
        """
        from scm.study.record import study_row  # noqa: PLC0415  an extra, and half a second

        folder = self.folder(name)
        results_ns = written_ns(folder / CASES)
        known_ns, known = self._complete.get(name, (0, None))
        if known is not None and known_ns == results_ns:
            return known
        try:
            row = study_row(folder)
        except (ScmError, OSError) as cause:
            return StudyRow(name=name, state="unreadable", trouble=without_paths(str(cause)))
        if row.state == "complete":
            self._complete[name] = results_ns, row
        return row

    def study(self, name: str) -> Study:
        """Return a study and what came of it.

        Raises:
            RefusedError: when there is none of that name, or it cannot be read.
        """
        return msgspec.json.decode(_shown(self.folder(name), "--json"), type=Study)

    def page(self, name: str) -> Path:
        """Return the page of a study; it is made unless it shows all cases of a complete one.

        Raises:
            RefusedError: when there is none of that name, or it cannot be read.
        """
        folder = self.folder(name)
        if not 0 < written_ns(folder / CASES) < written_ns(folder / PAGE):
            _shown(folder, "--html")
        return folder / PAGE

    def _dated(self) -> Iterator[tuple[int, str]]:
        if self._root is not None and self._root.is_dir():
            for folder in self._root.iterdir():
                if re.fullmatch(NAME, folder.name) and folder.is_dir():
                    yield written_ns(folder / "study.toml"), folder.name


def _shown(folder: Path, how: str) -> str:
    """Return the last line that `scm study show` prints."""
    try:
        words = ["study", "show", str(folder), how]
        return run_scm(words, None, lambda _: None, kinder=False)[-1]  # somebody waits for it
    except RunError as cause:
        raise RefusedError.of("unreadable", without_paths(str(cause))) from None


def _check_installed() -> None:
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        detail = f"studies need {', '.join(missing)}: `pip install 'scm[study]'`"
        raise RefusedError.of("not_installed", detail)
