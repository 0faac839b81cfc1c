"""What must outlive the process that keeps it: the red button, and the faults of signals.

Whoever restarts a part hears what the city latched, and hands it to the part's next run. Without
that a crash would release the stop, or reset a monitor, which only a person may.
"""

from scm.v2x.message import Message
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.monitor_status import MonitorStatus

HEARD = (CityStop, MonitorStatus)


class Latched:
    """What is latched now, as last told by those who keep it."""

    def __init__(self) -> None:
        self._stopped_by: str | None = None
        self._faults: dict[str, str] = {}

    def heard(self, message: Message) -> None:
        """Note what was latched, or released."""
        if isinstance(message, CityStop):
            self._stopped_by = message.by if message.engaged else None
        elif isinstance(message, MonitorStatus):
            self._faults.pop(message.junction, None)
            if message.fault is not None:
                self._faults[message.junction] = message.fault

    def world_arguments(self) -> list[str]:
        """Return what `scm world` needs to be told."""
        return [] if self._stopped_by is None else [f"--stopped-by={self._stopped_by}"]

    def monitor_arguments(self) -> list[str]:
        """Return what `scm monitor` needs to be told."""
        return [f"--fault={junction}={fault}" for junction, fault in self._faults.items()]
