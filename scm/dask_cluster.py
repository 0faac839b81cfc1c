"""A Dask cluster that exists already, as what runs tasks; needs the extra `scm[study]`."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from scm.errors import RunError

if TYPE_CHECKING:
    from distributed import Client

P = ParamSpec("P")
T = TypeVar("T")
CONNECT_S = 5
SCHEDULER_HELP = (
    "on a Dask cluster that exists, as tcp://head:8786. Its workers may be on other machines that "
    "see the same folders; start them by `dask worker ADDRESS --nworkers N --nthreads 1`"
)
_busy = threading.Lock()


def connected(address: str) -> "Client":
    """Return a client of the cluster whose scheduler is at an address.

    Raises:
        RunError: when there is no scheduler, it has no workers, or Dask is not installed.
    """
    try:
        from distributed import Client  # noqa: PLC0415  an extra, and slow to import
    except ModuleNotFoundError as cause:
        msg = "--scheduler needs Dask, which is not installed: pip install 'scm[study]'"
        raise RunError(msg) from cause
    try:
        client = Client(address, timeout=CONNECT_S)
    except (OSError, TimeoutError, ValueError) as cause:
        raise RunError(f"--scheduler {address}: no Dask scheduler there: {cause}") from cause
    if not client.nthreads():
        client.close()
        raise RunError(f"--scheduler {address}: it has no workers: dask worker {address}")
    return client


@contextmanager
def cluster_executor(address: str) -> Iterator[Executor]:
    """Use a cluster as an executor; what is not done at the end is cancelled.

    Raises:
        RunError: as `connected`.
    """
    with connected(address) as client:
        executor = client.get_executor(pure=False)
        try:
            yield _OneAtATime(executor)
        finally:
            executor.shutdown(wait=False)


class _OneAtATime(Executor):
    """Runs one task at a time in each worker process, however many threads it has.

    A diagnosis limits the threads of the linear algebra, for its whole process.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        return self._executor.submit(_alone, partial(fn, *args, **kwargs))


def _alone(work: Callable[[], T]) -> T:
    with _busy:
        return work()
