"""Operations on signals of a city.

Written by docs/make/client.py: do not change it here.
"""

from scm.client.connection import Connection, part
from scm.client.records.signals import JunctionRow, Junctions, MonitorStatus, PlanReply


class SignalsNoun:
    """Operations on signals."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def all_signals(self) -> Junctions:
        """All junctions."""
        return self._connection.ask("GET", "/api/v1/signals", Junctions)

    def one_signal(self, name: str) -> JunctionRow:
        """One junction.

        Args:
            name: a name on the bus
        """
        return self._connection.ask("GET", f"/api/v1/signals/{part(name)}", JunctionRow)

    def plan(
        self, name: str, *, plan: str, by: str = "api", reason: str = "", idempotency_key: str = ""
    ) -> PlanReply:
        """Wish for another plan.

        Args:
            name: a name on the bus
            plan: its name, or `flash`
            by: who wishes it
            reason: why, for the log
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.ask(
            "PUT",
            f"/api/v1/signals/{part(name)}/plan",
            PlanReply,
            body={"plan": plan, "by": by, "reason": reason},
            key=idempotency_key,
        )

    def reset(
        self, name: str, *, by: str = "api", reason: str, idempotency_key: str = ""
    ) -> MonitorStatus:
        """Clear a latched fault of the monitor.

        Args:
            name: a name on the bus
            by: who wishes it
            reason: why it is safe to go on, for the log
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.ask(
            "POST",
            f"/api/v1/signals/{part(name)}/monitor/reset",
            MonitorStatus,
            body={"by": by, "reason": reason},
            key=idempotency_key,
        )
