"""What runs cases: this machine's cores, a Dask cluster that exists, or Slurm."""

import hashlib
import io
import logging
import os
import tarfile
import tempfile
import threading
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, as_completed

from scm.dask_cluster import connected
from scm.errors import RunError, StudyError
from scm.study.case_process import STUDY, CaseProcesses, Task
from scm.study.loaded_study import LoadedStudy, load
from scm.study.row import Row

QUIET = {  # nobody looks at what a cluster in this process measures of itself: 4 % of a core
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "10s",
    "distributed.admin.system-monitor.interval": "60s",
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.scheduler.work-stealing-interval": "60s",
}
AHEAD = 4  # cases that a core has waiting: a worker never waits for the next one
TRIES = 3  # of cases whose Slurm job was lost
SHARES_PER_JOB, MOST_SHARES = 8, 1000  # Slurm takes arrays of 1001 as it is installed


class Engine(Protocol):
    """Runs cases somewhere."""

    about: str
    """Where, for people."""

    @property
    def cores(self) -> int:
        """How many cases run at a time."""
        ...

    def run(self, tasks: Iterable[Task]) -> Iterator[Row]:
        """Yield the row of each task as it comes, in any order."""
        ...


class DaskEngine:
    """Cases on the workers of a Dask cluster; one that is lost costs nothing but time.

    Args:
        client: Connected to the cluster.
        study: What is run.
        folder: Of the study file and all that it names: workers get a copy.
        about: Which cluster, for people.
    """

    def __init__(self, client: Client, study: LoadedStudy, folder: Path, about: str) -> None:
        self._client, self._study, self.about = client, study, about
        packed = _packed(study, folder)
        self._key = hashlib.blake2s(packed).hexdigest()
        self._sent = client.scatter(packed, broadcast=True)

    def run(self, tasks: Iterable[Task]) -> Iterator[Row]:
        """Yield the row of each task as it comes, in any order."""
        study, waiting = iter(tasks), dict[Any, Task]()
        name = self._study.file.name

        def submit(task: Task) -> Future[Row]:
            future = self._client.submit(
                run_on_worker, self._sent, self._key, name, task, pure=False, priority=-task.case
            )
            waiting[future.key] = task
            return future

        first = map(submit, islice(study, AHEAD * self.cores))
        coming = as_completed(first, raise_errors=False)
        try:
            for future in coming:
                task = waiting.pop(future.key)
                following = next(study, None)
                if following is not None:
                    coming.add(submit(following))
                yield self._row(future, task)
        finally:
            coming.clear()
            self._client.cancel([Future(key, self._client) for key in waiting])

    @property
    def cores(self) -> int:
        """How many cases run at a time."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def close(self) -> None:
        """End the case processes of this study on all workers."""
        self._client.run(close_on_worker, self._key)

    def _row(self, future: Future[Row], task: Task) -> Row:
        cause = future.exception()
        if cause is None:
            row: Row = future.result()
            return row
        if isinstance(cause, KilledWorker):
            text = "every worker that ran it died"
        elif isinstance(cause, StudyError):
            raise cause
        else:
            text = f"{type(cause).__name__}: {cause}"
        return self._study.row(task.case, task.values, "error", 0.0, text)


@contextmanager
def engine_of(
    study: LoadedStudy,
    folder: Path,
    workers: int | None = None,
    scheduler: str | None = None,
    slurm: str | None = None,
) -> Iterator[Engine]:
    """Use what a command line chose: a Dask cluster, Slurm, or else cores of this machine.

    Raises:
        RunError: when there is no such cluster.
    """
    if slurm is not None:
        yield slurm_engine(study, folder, slurm)
    elif scheduler is not None:
        with dask_engine(study, folder, scheduler) as engine:
            yield engine
    else:
        with local_engine(study, folder, workers or own_cores()) as engine:
            yield engine


@contextmanager
def local_engine(study: LoadedStudy, folder: Path, workers: int) -> Iterator[Engine]:
    """Use cores of this machine, by a Dask cluster in this process.

    Its threads only wait for the case processes. It has Dask's dashboard if bokeh is installed.
    """
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # rows say what went wrong
    with (
        dask.config.set(QUIET),
        LocalCluster(
            n_workers=1, threads_per_worker=workers, processes=False, dashboard_address=":0",
            memory_limit=0,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        engine = DaskEngine(client, study, folder, f"{workers} processes")
        try:
            yield engine
        finally:
            engine.close()


@contextmanager
def dask_engine(study: LoadedStudy, folder: Path, address: str) -> Iterator[Engine]:
    """Use a Dask cluster that exists.

    Raises:
        RunError: when there is no scheduler at the address, or it has no workers.
    """
    with connected(address) as client:
        engine = DaskEngine(client, study, folder, f"Dask at {address}, {client.dashboard_link}")
        try:
            yield engine
        finally:
            engine.close()


class SlurmEngine:
    """Cases in jobs of a Slurm array, by submitit; each job takes one share of them.

    There are several shares for each job that runs at a time: rows come while others still run, and
    a job that is cancelled costs little.

    Args:
        executor: Of submitit; its jobs see the folder, as a cluster's shared file system offers.
        jobs: How many.
    """

    def __init__(self, executor: Any, study: LoadedStudy, folder: Path, jobs: int) -> None:
        self._executor, self._study, self._folder = executor, study, folder
        self.cores = jobs
        self.about = f"{jobs} Slurm jobs"

    def run(self, tasks: Iterable[Task]) -> Iterator[Row]:
        """Yield the row of each task, job by job as they end; cases of lost jobs run again.

        Raises:
            RunError: when jobs were lost again and again.
        """
        left, why = list(tasks), ""
        for _ in range(TRIES):
            if not left:  # submitit takes no empty array
                return
            left, why = yield from self._run_once(left)
        if left:
            raise RunError(f"{why}; {len(left)} cases are left, the same command goes on with them")

    def _run_once(self, tasks: list[Task]) -> Generator[Row, None, tuple[list[Task], str]]:
        """Yield rows; return the tasks of jobs that were lost, and how the last one was."""
        import submitit  # noqa: PLC0415

        count = min(len(tasks), max(self.cores, min(SHARES_PER_JOB * self.cores, MOST_SHARES)))
        shares = [tasks[n::count] for n in range(count)]
        folder, name = str(self._folder.resolve()), self._study.file.name
        jobs = self._executor.map_array(run_share, [folder] * count, [name] * count, shares)
        lost, why = list[Task](), ""
        for job, share in zip(jobs, shares, strict=True):
            try:
                yield from job.result()
            except (
                submitit.core.utils.UncompletedJobError,
                submitit.core.utils.FailedJobError,
            ) as cause:
                why = f"Slurm job {job.job_id}: {str(cause).partition(chr(10))[0]}"
                lost += share
        return lost, why


def slurm_engine(study: LoadedStudy, folder: Path, options: str) -> SlurmEngine:
    """Use Slurm, with options as of `sbatch`: `-p cpu -n 64 -t 60`.

    Raises:
        RunError: when an option is not known, or this machine has no Slurm.
    """
    import submitit  # noqa: PLC0415  few studies run on Slurm

    given, jobs = slurm_options(options)
    try:
        executor = submitit.SlurmExecutor(folder / "slurm")
    except RuntimeError as cause:
        raise RunError(f"--slurm: {cause}") from cause
    executor.update_parameters(**given)
    return SlurmEngine(executor, study, folder, jobs)


def slurm_options(text: str) -> tuple[dict[str, Any], int]:
    """Return options of `sbatch` as submitit's parameters, and the number of jobs (`-n`).

    Raises:
        RunError: naming an option that is not known.
    """
    import argparse  # noqa: PLC0415
    import shlex  # noqa: PLC0415

    parser = argparse.ArgumentParser(add_help=False, exit_on_error=False)
    parser.add_argument("-n", "--ntasks", type=int, default=8)
    parser.add_argument("-p", "--partition")
    parser.add_argument("-t", "--time", type=int, default=60)
    parser.add_argument("-A", "--account")
    parser.add_argument("-q", "--qos")
    parser.add_argument("-c", "--cpus-per-task", type=int, default=1)
    parser.add_argument("--mem")
    parser.add_argument("--constraint")
    try:
        found, unknown = parser.parse_known_args(shlex.split(text))
    except (argparse.ArgumentError, ValueError) as cause:
        raise RunError(f"--slurm {text!r}: {cause}") from cause
    if unknown:
        known = ", ".join(action.option_strings[-1] for action in parser._actions)  # noqa: SLF001
        raise RunError(f"--slurm {text!r}: no option {unknown[0]!r} here, expected {known}")
    given = {key: value for key, value in vars(found).items() if value is not None}
    jobs = given.pop("ntasks")
    return {**given, "array_parallelism": jobs}, jobs


def run_share(folder: str, name: str, tasks: list[Task]) -> list[Row]:
    """Run cases one after the other, in a job."""
    study = load(Path(folder) / STUDY, name)
    processes = CaseProcesses(study, Path(folder))
    try:
        return [processes.run(task) for task in tasks]
    finally:
        processes.close()


_studies: dict[str, CaseProcesses] = {}
_loading = threading.Lock()


def run_on_worker(packed: bytes, key: str, name: str, task: Task) -> Row:
    """Run a case in a process of this worker; its thread waits."""
    with _loading:
        if key not in _studies:
            folder = Path(tempfile.mkdtemp(prefix="scm-study-"))
            with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
                archive.extractall(folder, filter="data")
            _studies[key] = CaseProcesses(load(folder / STUDY, name), folder)
    return _studies[key].run(task)


def close_on_worker(key: str) -> None:
    """End the case processes of a study on this worker."""
    import shutil  # noqa: PLC0415

    with _loading:
        processes = _studies.pop(key, None)
    if processes is not None:
        processes.close()
        shutil.rmtree(processes.folder, ignore_errors=True)


def _packed(study: LoadedStudy, folder: Path) -> bytes:
    """Return the study file and all that it names as a tar archive."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for name in (Path(STUDY), *study.file.files()):
            entry = tarfile.TarInfo(str(name))
            content = (folder / name).read_bytes()
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return packed.getvalue()


def own_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
