"""Folders that the interface reads and writes, each for one kind of file."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Folders:
    """Where files lie; None: this city offers none of them.

    Attributes:
        recordings: MCAP files of the city's runs, the one being written among them.
        reports: A folder for each mismatch report, and for the job that makes it.
        scenarios: Fleet scenario scripts, `*.py`.
        calibrations: What the Eye's calibration found, a file a camera.
        plans: Signal plans that people edited, a file a junction and plan.
        studies: A folder for each study.
    """

    recordings: Path | None = None
    reports: Path | None = None
    scenarios: Path | None = None
    calibrations: Path | None = None
    plans: Path | None = None
    studies: Path | None = None


def written_ns(path: Path) -> int:
    """Return when a file was last written [ns since 1970]; 0: it is not there."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def folders_in(folder: Path) -> Folders:
    """Return all folders inside one, recordings at its top; writers create theirs."""
    return Folders(
        recordings=folder,
        reports=folder / "reports",
        scenarios=folder / "scenarios",
        calibrations=folder / "calibrations",
        plans=folder / "plans",
        studies=folder / "studies",
    )
