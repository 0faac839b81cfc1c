"""The crowd's driver compiled by a process of its own, while this one compiles the rest.

Only the first start on a machine does this: afterwards both halves lie in the cache. Run as a
module it compiles and ends.
"""

import contextlib
import logging
import subprocess
import sys
from collections.abc import Iterator

from scm.log import event
from scm.vehicles.drivers.law import decide
from scm.vehicles.jit import is_kept

_GRACE_S = 60.0
_LOG = logging.getLogger(__name__)


@contextlib.contextmanager
def compiled_beside() -> Iterator[None]:
    """Compile the driver in a second process during the block, if nobody has; wait for its end.

    Should that process fail, the driver is compiled here later, at its first use.
    """
    if is_kept(decide):
        yield
        return
    event(_LOG, "first_start", doing="compiling physics and drivers, once", takes_s=10)
    command = [sys.executable, "-m", __name__]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as helper:
        try:
            yield
            with contextlib.suppress(subprocess.TimeoutExpired):
                helper.wait(_GRACE_S)
        finally:
            helper.kill()


def _compile() -> None:
    from scm.maps.load import load_map  # noqa: PLC0415
    from scm.maps.route import Roads  # noqa: PLC0415
    from scm.vehicles.drivers.crowd import Crowd  # noqa: PLC0415
    from scm.vehicles.drivers.streets import streets_of  # noqa: PLC0415

    Crowd(streets_of(Roads(load_map("driving_school"))), 1).warm()


if __name__ == "__main__":
    _compile()
