"""The detector: from CAMs and tracks to suspicions of stations.

A CAM that several roadside units receive counts once. No input can stop it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

from scm.clock import NS_PER_S, nanoseconds
from scm.traffic.misbehaviour.check import (
    CONFIRMED,
    HARD_DRIVING_S,
    NEWCOMER_S,
    Case,
    Check,
    Sender,
    Standing,
    load_checks,
)
from scm.traffic.misbehaviour.claim import Claim, claim_of
from scm.traffic.misbehaviour.fusion import FREE_POINTS, StationHistory
from scm.traffic.misbehaviour.ground import Ground
from scm.traffic.misbehaviour.kalman import ACCEL_PSD, HARD_PSD
from scm.traffic.misbehaviour.likely import LEAST, Box, overlap_m
from scm.traffic.misbehaviour.limits import REAPPEARS_S, Limits
from scm.v2x.etsi.cam_spatem import CamBody
from scm.v2x.etsi.convert import station_id
from scm.v2x.messages.eye_track import EyeTrack

MAX_TRACK_AGE_NS = NS_PER_S // 3  # of the Eye, when compared with a claim
EYE_RESTART_NS = 2 * NS_PER_S  # without any track: the Eye has begun anew
MAX_EYE_SILENCE_NS = NS_PER_S // 2  # after its newest track the Eye is reported as working
MEMORY_NS = 60 * NS_PER_S  # of stations and tracks
RESTART_SILENCE_NS = 2 * NS_PER_S  # without any CAM: reception was lost, and begins anew
CELL_M = 0.5  # in which neighbours are searched; longer than a car
TOUCH_M = 0.03  # between two cars that may push each other
BAD_FLAGS = frozenset({"tentative", "duplicate", "disagree", "wrong_id", "jumped"})
MAX_STATIONS = 10_000  # more than any city has: a flood of new numbers must not fill the memory
UNSUSPICIOUS = 10.0**-FREE_POINTS  # plausibility from which a finding gives no points
MAX_IDLE_GAP_S, UNCHANGED_SHARE = 0.9, 0.5  # a fast CAM; share of a trigger that is no change
MAX_AGE_S = 60.0  # that a track may claim
MIN_DRIVEN_S = 0.001  # a time to divide by
UNKNOWN = Sender()
TRIGGER_M, TRIGGER_MPS, TRIGGER_RAD = 4.0 / 14.0, 0.5 / 14.0, math.radians(4.0)  # EN 302 637-2


class CheckedClaim(NamedTuple):
    """One claim, the suspicious findings of the checks, and whether a report is due."""

    claim: Claim
    history: StationHistory
    findings: list[tuple[Check, float]]
    is_reported: bool


class Detector:
    """Judges all stations of a city.

    Attributes:
        histories: By station number.
        claims_checked: How many, so far.
        eye_ns: When a camera last saw any car; None: no track was ever received.
    """

    def __init__(
        self,
        ground: Ground,
        limits_of: Callable[[str], Limits] | None = None,
        checks: Sequence[Check] | None = None,
    ) -> None:
        """Use the map's knowledge, the limits of cars by car file, and the checks.

        Args:
            ground: The map's knowledge.
            limits_of: Returns the limits of a car file; None: all are Nigels.
            checks: None: all there are.
        """
        nigel = Limits()
        self._limits_of = cache(limits_of or (lambda _car: nigel))
        chosen = load_checks() if checks is None else checks
        # Those that the Eye can overrule come after those by which it confirms.
        self._checks = sorted(chosen, key=lambda check: check.witnessed)
        self._ground = ground
        self.histories: dict[int, StationHistory] = {}
        self.claims_checked = 0
        self._numbers: dict[str, int] = {}
        self._cells: dict[tuple[int, int], dict[int, Claim]] = {}
        self._tracks: dict[int, EyeTrack] = {}
        self._seen: set[int] = set()
        self.eye_ns: int | None = None
        self._eye_began_ns = 0
        self._standings: dict[int, Standing] = {}
        self._began_ns: int | None = None
        self._received_ns = 0

    def see(self, track: EyeTrack) -> None:
        """Add a track of the Eye."""
        who = self._number(track.vehicle)
        self._tracks[who] = track
        if not track.stale and BAD_FLAGS.isdisjoint(track.flags):
            self._seen.add(who)
        seen, before = seen_ns(track), self.eye_ns
        if before is None or seen - before > EYE_RESTART_NS:
            self._eye_began_ns = seen
        # A track cannot be older than its last view: a time from the future is dropped again.
        self.eye_ns = seen if before is None or before > track.t_ns else max(seen, before)

    def receive(
        self, station: str, receiver: str, sent_ns: int, body: CamBody, lost_ns: int = 0,
        sender: Sender = UNKNOWN,
    ) -> CheckedClaim | None:  # fmt: skip
        """Check a CAM; None: it was received before by another unit, or has no position.

        `lost_ns` is that of `CamRx`: time in which the car was not moved; `sender` what the city
        knows of it.
        """
        history = self._history(body.station_id, station, sent_ns)
        newest = history.newest
        if newest is not None and sent_ns <= newest.sent_ns:
            return None
        limits = self._limits_of(sender.car)
        claim = claim_of(station, receiver, sent_ns, body, limits, lost_ns)
        if claim is None:
            return None
        if self._began_ns is None or sent_ns - self._received_ns > RESTART_SILENCE_NS:
            self._began_ns = sent_ns
        self._received_ns = sent_ns
        case = self._case(claim, history, sender, limits)
        findings = self._run_checks(case)
        due = history.add(claim, case.gap_s, findings)
        self._place(claim, newest)
        history.newest = claim
        self._standings[claim.who] = Standing(history.score, history.first_ns)
        self.claims_checked += 1
        return CheckedClaim(claim, history, findings, due)

    def track_of(self, who: int) -> EyeTrack | None:
        """Return the newest track of a station's own tag, however old."""
        return self._tracks.get(who)

    def forget(self, now_ns: int) -> None:
        """Drop stations and tracks that were not received for a minute."""
        for who, history in list(self.histories.items()):
            newest = history.newest
            if newest is not None and now_ns - newest.sent_ns > MEMORY_NS:
                self._cells.get(_cell(*newest.middle), {}).pop(who, None)
                del self.histories[who]
                self._standings.pop(who, None)
                self._seen.discard(who)
        self._tracks = {w: t for w, t in self._tracks.items() if now_ns - t.t_ns < MEMORY_NS}

    def _history(self, who: int, station: str, sent_ns: int) -> StationHistory:
        history = self.histories.get(who)
        if history is None:
            if len(self.histories) >= MAX_STATIONS:
                self.histories.pop(next(iter(self.histories)))
            history = self.histories[who] = StationHistory(station, sent_ns)
        return history

    def _number(self, name: str) -> int:
        number = self._numbers.get(name)
        if number is None:
            if len(self._numbers) >= MAX_STATIONS:
                self._numbers.clear()
            number = self._numbers[name] = station_id(name)
        return number

    def _run_checks(self, case: Case) -> list[tuple[Check, float]]:
        findings: list[tuple[Check, float]] = []
        confirmed = False
        for check in self._checks:
            if (confirmed and check.witnessed) or (case.is_new and _may_wait(check)):
                continue
            plausibility = check.judge(case)
            if plausibility is None:
                continue
            if plausibility < UNSUSPICIOUS:
                findings.append((check, max(plausibility, check.floor)))
            if check.name == "eye_position":
                confirmed = plausibility >= CONFIRMED
        return findings

    def _case(self, claim: Claim, history: StationHistory, sender: Sender, limits: Limits) -> Case:
        before = history.newest
        gap_s = 0.0 if before is None else (claim.sent_ns - before.sent_ns) * 1e-9
        if gap_s > REAPPEARS_S:
            before = None
        dt_s = 0.0 if before is None else (claim.t_ns - before.t_ns) * 1e-9
        driven_s = dt_s
        if before is not None and claim.lost_ns > before.lost_ns:
            driven_s = _driven_s(claim, before, limits.front_share)
            history.late_ns = claim.t_ns
        history.idle = _idle(claim, before, gap_s, history.idle)
        if sender.by_hand or sender.stopped or sender.touches:
            history.hard_ns = claim.sent_ns
        is_hard = _since_s(claim.sent_ns, history.hard_ns) <= HARD_DRIVING_S
        limits = limits.hard if is_hard else limits
        self._filter(claim, history, before, driven_s, limits, HARD_PSD if is_hard else ACCEL_PSD)
        if sender.touches:  # a push acts between two claims
            history.strayed.begin()
        track = self._fresh(claim)
        eye_sees = self._eye_sees(claim)
        is_new = bool(sender.car) and claim.sent_ns - history.first_ns <= NEWCOMER_S * NS_PER_S
        unseen = bool(sender.car) and (claim.who not in self._seen or not limits.has_tag)
        has_looked = _since_s(claim.sent_ns, self._eye_began_ns) > NEWCOMER_S and not is_new
        history.is_tag_unseen = unseen and has_looked and (eye_sees or history.is_tag_unseen)
        neighbours = self._around(claim)
        return Case(
            now=claim,
            limits=limits,
            ground=self._ground,
            before=before,
            dt_s=dt_s,
            driven_s=driven_s,
            since_lost_s=_since_s(claim.t_ns, history.late_ns),
            gap_s=gap_s,
            kalman=history.kalman,
            neighbours=neighbours,
            strayed=history.strayed,
            standings=self._standings,
            track=track,
            is_tag_unseen=unseen,
            is_new=is_new,
            is_hard=is_hard,
            unseen_s=0.0 if track is None else abs(claim.t_ns - seen_ns(track)) * 1e-9,
            nearest_track_m=self._nearest_m(claim, limits)
            if eye_sees and track is None
            else math.inf,
            eye_sees=eye_sees,
            since_start_s=(claim.sent_ns - (self._began_ns or claim.sent_ns)) * 1e-9,
            idle=history.idle,
            is_own_number=self._number(claim.station) == claim.who,
            touches=lambda: sender.touches or self._touches(claim, neighbours, limits),
        )

    def _filter(
        self, claim: Claim, history: StationHistory, before: Claim | None, driven_s: float,
        limits: Limits, psd: float,
    ) -> None:  # fmt: skip
        x, y = claim.rear(limits.front_share)
        kalman = history.kalman
        if claim.yaw_rad is None or claim.speed_mps is None:
            kalman.stop()
            history.strayed.begin()
            return
        yaw, speed = claim.yaw_rad, claim.speed_mps
        vx, vy = speed * math.cos(yaw), speed * math.sin(yaw)
        if before is None or driven_s <= 0.0 or not kalman.has_begun:
            kalman.begin(x, y, vx, vy)
            history.strayed.begin()
        else:
            kalman.update(driven_s, x, y, vx, vy, claim.own_m, claim.own_mps, psd)
            history.strayed.add(claim, before, driven_s, limits.front_share)

    def _fresh(self, claim: Claim) -> EyeTrack | None:
        track = self._tracks.get(claim.who)
        return track if track is not None and _is_fresh(track, claim.t_ns) else None

    def _eye_sees(self, claim: Claim) -> bool:
        if self.eye_ns is None or abs(claim.t_ns - self.eye_ns) > MAX_TRACK_AGE_NS:
            return False
        return self._ground.sees(*claim.middle)

    def _nearest_m(self, claim: Claim, limits: Limits) -> float:
        x, y = claim.rear(limits.front_share)
        return min(
            (
                math.hypot(x - track.x_m, y - track.y_m)
                for track in self._tracks.values()
                if not track.stale and abs(claim.t_ns - track.t_ns) <= MAX_TRACK_AGE_NS
            ),
            default=math.inf,
        )

    def _touches(self, claim: Claim, neighbours: tuple[Claim, ...], limits: Limits) -> bool:
        """Return whether the claimed car, a little larger, overlaps another one."""
        if claim.yaw_rad is None:
            return False
        length_m, width_m = claim.size
        size = length_m + TOUCH_M, width_m + TOUCH_M
        box: Box = (*claim.middle, claim.yaw_rad, *size)
        near_ns = 2 * MAX_TRACK_AGE_NS
        claimed = (
            (*other.middle, other.yaw_rad, other.size[0] + TOUCH_M, other.size[1] + TOUCH_M)
            for other in neighbours
            if other.yaw_rad is not None and abs(claim.t_ns - other.t_ns) <= near_ns
        )
        seen = self._seen_beside(claim, size, limits)
        return any(overlap_m(box, other) > 0.0 for other in (*claimed, *seen))

    def _seen_beside(
        self, claim: Claim, size: tuple[float, float], limits: Limits
    ) -> Iterator[Box]:
        """Yield the outlines of all other tracked cars, as large as this one.

        Flagged tracks too: two cars that press against each other hide each other's tags.
        """
        ahead = (limits.front_share - 0.5) * claim.size[0]
        for who, track in self._tracks.items():
            if who != claim.who and abs(claim.t_ns - track.t_ns) <= MAX_TRACK_AGE_NS:
                x = track.x_m + ahead * math.cos(track.yaw_rad)
                y = track.y_m + ahead * math.sin(track.yaw_rad)
                yield (x, y, track.yaw_rad, *size)

    def _around(self, claim: Claim) -> tuple[Claim, ...]:
        i, j = _cell(*claim.middle)
        found: list[Claim] = []
        for a in (i - 1, i, i + 1):
            for b in (j - 1, j, j + 1):
                held = self._cells.get((a, b))
                if held:
                    found += held.values()
        return tuple(one for one in found if one.who != claim.who)

    def _place(self, claim: Claim, before: Claim | None) -> None:
        cell = _cell(*claim.middle)
        if before is not None:
            was = _cell(*before.middle)
            if was != cell:
                self._cells.get(was, {}).pop(claim.who, None)
        self._cells.setdefault(cell, {})[claim.who] = claim


def _may_wait(check: Check) -> bool:
    """Return whether a check does not apply to a newcomer: it uses the map or the Eye alone."""
    return check.floor > LEAST and check.kind != "longAcc"


def _cell(x: float, y: float) -> tuple[int, int]:
    return math.floor(x / CELL_M), math.floor(y / CELL_M)


def seen_ns(track: EyeTrack) -> int:
    """Return when a camera last saw a track's car; later poses are predictions."""
    age_s = track.age_s if 0.0 <= track.age_s < MAX_AGE_S else MAX_AGE_S
    return track.t_ns - nanoseconds(age_s)


def _driven_s(claim: Claim, before: Claim, front_share: float) -> float:
    """Return the time that a car drove between two claims, where some of it was lost [s].

    Of the lost time only a maximum is known, so the time in which the claimed speeds make the way
    counts, within that maximum.
    """
    dt_s = (claim.t_ns - before.t_ns) * 1e-9
    lost_s = (claim.lost_ns - before.lost_ns) * 1e-9
    (x1, y1), (x0, y0) = claim.rear(front_share), before.rear(front_share)
    way_m = math.hypot(x1 - x0, y1 - y0)
    v1, v0 = claim.speed_mps, before.speed_mps
    speed_mps = 0.0 if v1 is None or v0 is None else abs(v1 + v0) / 2.0
    needed_s = way_m / speed_mps if speed_mps > 0.0 else dt_s
    return min(dt_s, max(MIN_DRIVEN_S, dt_s - lost_s, needed_s))


def _since_s(now_ns: int, then_ns: int | None) -> float:
    return math.inf if then_ns is None else (now_ns - then_ns) * 1e-9


def _is_fresh(track: EyeTrack, t_ns: int) -> bool:
    if track.stale or abs(t_ns - track.t_ns) > MAX_TRACK_AGE_NS:
        return False
    return not track.flags or BAD_FLAGS.isdisjoint(track.flags)


def _idle(claim: Claim, before: Claim | None, gap_s: float, idle: int) -> int:
    """Return how many claims in a row came fast although the car had not moved."""
    if before is None or gap_s > MAX_IDLE_GAP_S:
        return 0
    moved = math.hypot(claim.x_m - before.x_m, claim.y_m - before.y_m) / TRIGGER_M
    if claim.speed_mps is not None and before.speed_mps is not None:
        moved = max(moved, abs(claim.speed_mps - before.speed_mps) / TRIGGER_MPS)
    if claim.yaw_rad is not None and before.yaw_rad is not None:
        turned = math.remainder(claim.yaw_rad - before.yaw_rad, math.tau)
        moved = max(moved, abs(turned) / TRIGGER_RAD)
    return 0 if moved > UNCHANGED_SHARE else idle + 1
