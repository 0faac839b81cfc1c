"""Operations on signals of a city.

Written by docs/make/client.py: do not change it here.
"""

from typing import Literal

from scm.client.operation import Noun, operation
from scm.records.operations import Operation
from scm.records.page import Page
from scm.records.signal_history import ForecastScore, History, Verdict
from scm.records.signal_plans import PlanProof, PlanRow, StageBody
from scm.records.signals import FlashReply, JunctionRow, SignalOverride, Signals, StatusRow
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.plan_request import PlanReply
from scm.v2x.messages.signal_request import SignalReply
from scm.v2x.messages.signal_site import SignalSite


class SignalsNoun(Noun):
    """Operations on signals."""

    @operation("GET", "/api/v1/signals/{name}/plans")
    def plans(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[PlanRow]:
        """All plans of a junction."""

    @operation("GET", "/api/v1/signals/{name}/plans/{plan}")
    def one_plan(self, name: str, plan: str) -> PlanRow:
        """One plan.

        Args:
            plan: a plan's name
        """

    @operation("PUT", "/api/v1/signals/{name}/plans/{plan}")
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
            plan: a plan's name
            about: what it is for
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            stages: in the order of the cycle
            offset_s: when its cycle begins, after a time that is a whole number of cycles on the
                controller's clock, less than the cycle; plans with the same cycle are then
                coordinated; null: no offset
        """

    @operation("DELETE", "/api/v1/signals/{name}/plans/{plan}")
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
            plan: a plan's name
        """

    @operation("POST", "/api/v1/signals/{name}/proofs")
    def prove(
        self, name: str, *, plan: str, stages: tuple[StageBody, ...], idempotency_key: str = ""
    ) -> Operation:
        """Search every state of kernel and plan for fault.

        Args:
            plan: what the plan will be called
            stages: in the order of the cycle
        """

    @operation("GET", "/api/v1/signals/{name}/proofs/{digest}")
    def proof(self, name: str, digest: str) -> PlanProof:
        """One proof.

        Args:
            digest: of a proof
        """

    @operation("GET", "/api/v1/signals")
    def all_signals(self) -> Signals:
        """All junctions."""

    @operation("GET", "/api/v1/signals/{name}")
    def one_signal(self, name: str) -> JunctionRow:
        """One junction."""

    @operation("GET", "/api/v1/signals/{name}/site")
    def site(self, name: str) -> SignalSite:
        """Phases, least times, conflicts, rings, policies."""

    @operation("GET", "/api/v1/signals/{name}/status")
    def status(self, name: str) -> StatusRow:
        """What runs, detectors, greens to come."""

    @operation("GET", "/api/v1/signals/{name}/history")
    def history(self, name: str) -> History:
        """What each group showed in the last ten minutes."""

    @operation("GET", "/api/v1/signals/{name}/promises")
    def promises(self, name: str) -> ForecastScore:
        """What SPaT published against what happened."""

    @operation("GET", "/api/v1/signals/{name}/wishes")
    def wishes(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[SignalOverride]:
        """Overrides in force, each with name, reason and end."""

    @operation("POST", "/api/v1/signals/{name}/calls")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
        """

    @operation("POST", "/api/v1/signals/{name}/holds")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
        """

    @operation("POST", "/api/v1/signals/{name}/force-offs")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
        """

    @operation("POST", "/api/v1/signals/{name}/omits")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
        """

    @operation("POST", "/api/v1/signals/{name}/preempts")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: signal groups
            expires_s: seconds until it lapses by itself
        """

    @operation("POST", "/api/v1/signals/{name}/clear")
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
        """Withdraw overrides of groups.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            groups: overrides of any of these groups; empty: of all groups
            verb: overrides of this kind; empty: of any
        """

    @operation("PUT", "/api/v1/signals/{name}/plan")
    def plan(
        self, name: str, *, by: str = "", reason: str = "", plan: str, idempotency_key: str = ""
    ) -> PlanReply:
        """Run another plan.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            plan: a plan by name (shipped, the map's own, or saved), a policy, or `flash`
        """

    @operation("PUT", "/api/v1/signals/{name}/policy")
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
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            policy: its name
            expires_s: seconds until it lapses by itself
        """

    @operation("PUT", "/api/v1/signals/{name}/flash")
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
        """Flash red, or end flashing.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why, for the log
            engaged: true: flash; false: resume, all red first
            expires_s: seconds until it ends by itself; null: not by itself
        """

    @operation("GET", "/api/v1/signals/{name}/monitor")
    def verdicts(self, name: str, *, limit: int = 100, cursor: str = "") -> Page[Verdict]:
        """The monitor's reports, newest first."""

    @operation("POST", "/api/v1/signals/{name}/monitor/reset")
    def reset(
        self, name: str, *, by: str = "", reason: str, idempotency_key: str = ""
    ) -> MonitorStatus:
        """Clear a latched fault of the monitor.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why it is over
        """
