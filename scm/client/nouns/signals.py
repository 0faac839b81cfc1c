"""Operations on signals of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.connection import Connection, part
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.signal_history import ForecastScore, History, Verdict
from scm.records.signal_plans import PlanProof, PlanRow, StageBody
from scm.records.signals import FlashReply, JunctionRow, SignalOverride, Signals, StatusRow
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply
from scm.v2x.messages.signal_request import SignalReply
from scm.v2x.messages.signal_site import SignalSite


class SignalsNoun:
    """Operations on signals."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def plans(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[PlanRow]:
        """All plans of a junction.

        Args:
            name: a name on the bus
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            f"/api/v1/signals/{part(name)}/plans",
            Page[PlanRow],
            query={"limit": limit, "cursor": cursor},
        )

    def one_plan(self, name: str, plan: str) -> PlanRow:
        """One plan.

        Args:
            name: a name on the bus
            plan: a plan's name
        """
        return self._connection.request(
            "GET", f"/api/v1/signals/{part(name)}/plans/{part(plan)}", PlanRow
        )

    def save(
        self,
        name: str,
        plan: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        about: str = "",
        by: str = "",
        reason: str = "",
        stages: tuple[StageBody, ...],
        offset_s: float | None = None,
        idempotency_key: str = "",
    ) -> PlanRow:
        """Save a proven plan.

        Args:
            name: a name on the bus
            plan: a plan's name
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            about: what it is for
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            stages: in the order of the cycle
            offset_s: when its cycle begins, after a time that is a whole number of cycles on the
                controller's clock, less than the cycle; plans with the same cycle keep step so;
                null: with nobody
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/signals/{part(name)}/plans/{part(plan)}",
            PlanRow,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            body={
                "about": about,
                "by": by,
                "reason": reason,
                "stages": stages,
                "offset_s": offset_s,
            },
            key=idempotency_key,
        )

    def delete(
        self,
        name: str,
        plan: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        idempotency_key: str = "",
    ) -> PlanRow:
        """Delete a saved plan.

        Args:
            name: a name on the bus
            plan: a plan's name
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/signals/{part(name)}/plans/{part(plan)}",
            PlanRow,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            key=idempotency_key,
        )

    def prove(
        self, name: str, *, plan: str, stages: tuple[StageBody, ...], idempotency_key: str = ""
    ) -> Operation:
        """Search every state of kernel and plan for fault.

        Args:
            name: a name on the bus
            plan: what the plan will be called
            stages: in the order of the cycle
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/proofs",
            Operation,
            body={"plan": plan, "stages": stages},
            key=idempotency_key,
        )

    def proof(self, name: str, digest: str) -> PlanProof:
        """One proof.

        Args:
            name: a name on the bus
            digest: of a proof
        """
        return self._connection.request(
            "GET", f"/api/v1/signals/{part(name)}/proofs/{part(digest)}", PlanProof
        )

    def all_signals(self) -> Signals:
        """All junctions."""
        return self._connection.request("GET", "/api/v1/signals", Signals)

    def one_signal(self, name: str) -> JunctionRow:
        """One junction.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/signals/{part(name)}", JunctionRow)

    def site(self, name: str) -> SignalSite:
        """Phases, least times, conflicts, rings, policies.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/signals/{part(name)}/site", SignalSite)

    def status(self, name: str) -> StatusRow:
        """What runs, detectors, greens to come.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/signals/{part(name)}/status", StatusRow)

    def history(self, name: str) -> History:
        """What each group showed in the last ten minutes.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/signals/{part(name)}/history", History)

    def promises(self, name: str) -> ForecastScore:
        """What SPaT told against what happened.

        Args:
            name: a name on the bus
        """
        return self._connection.request(
            "GET", f"/api/v1/signals/{part(name)}/promises", ForecastScore
        )

    def wishes(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[SignalOverride]:
        """Wishes in force, each with who, why and its end.

        Args:
            name: a name on the bus
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            f"/api/v1/signals/{part(name)}/wishes",
            Page[SignalOverride],
            query={"limit": limit, "cursor": cursor},
        )

    def call(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...],
        expires_s: float = 60.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Call groups: each is served once.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/calls",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "expires_s": expires_s},
            key=idempotency_key,
        )

    def hold(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...],
        expires_s: float = 60.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Hold groups: once green, they stay green.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/holds",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "expires_s": expires_s},
            key=idempotency_key,
        )

    def force_off(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...],
        expires_s: float = 60.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Force groups off: their green ends once others are called.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/force-offs",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "expires_s": expires_s},
            key=idempotency_key,
        )

    def omit(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...],
        expires_s: float = 60.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Omit groups: they are not begun.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/omits",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "expires_s": expires_s},
            key=idempotency_key,
        )

    def preempt(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...],
        expires_s: float = 60.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Pre-empt for one group: it comes next and stays.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/preempts",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "expires_s": expires_s},
            key=idempotency_key,
        )

    def clear(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        groups: tuple[str, ...] = (),
        verb: Literal["", "call", "force_off", "hold", "omit", "policy", "preempt"] = "",
        idempotency_key: str = "",
    ) -> SignalReply:
        """Take back what was asked of groups.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            groups: overrides of any of these groups; empty: of all groups
            verb: overrides of this kind; empty: of any
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/clear",
            SignalReply,
            body={"by": by, "reason": reason, "groups": groups, "verb": verb},
            key=idempotency_key,
        )

    def plan(
        self, name: str, *, by: str = "", reason: str = "", plan: str, idempotency_key: str = ""
    ) -> PlanReply:
        """Run another plan.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            plan: a plan by name (shipped, the map's own, or saved), a policy, or `flash`
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/signals/{part(name)}/plan",
            PlanReply,
            body={"by": by, "reason": reason, "plan": plan},
            key=idempotency_key,
        )

    def policy(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        policy: str,
        expires_s: float = 300.0,
        idempotency_key: str = "",
    ) -> SignalReply:
        """Run a policy for a while.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            policy: its name
            expires_s: seconds until it lapses by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/signals/{part(name)}/policy",
            SignalReply,
            body={"by": by, "reason": reason, "policy": policy, "expires_s": expires_s},
            key=idempotency_key,
        )

    def flash(
        self,
        name: str,
        *,
        by: str = "",
        reason: str = "",
        engaged: bool,
        expires_s: float | None = None,
        idempotency_key: str = "",
    ) -> FlashReply:
        """Flash red, or go on.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why, for the log
            engaged: true: flash; false: go on, all red first
            expires_s: seconds until it ends by itself; null: not by itself
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/signals/{part(name)}/flash",
            FlashReply,
            body={"by": by, "reason": reason, "engaged": engaged, "expires_s": expires_s},
            key=idempotency_key,
        )

    def verdicts(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[Verdict]:
        """What the monitor said, newest first.

        Args:
            name: a name on the bus
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            f"/api/v1/signals/{part(name)}/monitor",
            Page[Verdict],
            query={"limit": limit, "cursor": cursor},
        )

    def reset(
        self, name: str, *, by: str = "", reason: str, idempotency_key: str = ""
    ) -> MonitorStatus:
        """Clear a latched fault of the monitor.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why it is over
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/signals/{part(name)}/monitor/reset",
            MonitorStatus,
            body={"by": by, "reason": reason},
            key=idempotency_key,
        )
