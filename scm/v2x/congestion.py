"""Channel load and congestion control: air time of a frame, and the gap between two frames.

    air time  = 40 us + 8 us * ceil((16 + 8 bytes + 6) / (8 us * rate))        IEEE 802.11, 10 MHz
    busy ratio = time of all frames received / 100 ms                          CBR
    state goes up one step at once when the ratio exceeds its limit, down one when the ratio has
    stayed below the limit of the state below for five seconds

    state        relaxed  active 1  active 2  active 3  restrictive
    ratio up to   0.30     0.40      0.50      0.65         1
    gap [ms]       50       100       200       250       1000      frames of at most 0.5 ms

The CAM rules use the gap as T_GenCam_DCC. Source: TS 102 687 v1.2.1, 5.3 and annex A (the
table), v1.1.1 (up and down times); EN 302 637-2, 6.1.3.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.clock import NS_PER_MS, NS_PER_S

WINDOW_NS = 100 * NS_PER_MS
RELAX_AFTER_NS = 5 * NS_PER_S
REPORT_VALID_NS = 2 * NS_PER_S
ACTIVE_3_LIMIT = 0.65
LIMITS: Floats = np.array([0.30, 0.40, 0.50, ACTIVE_3_LIMIT, np.inf])
GAPS_NS: Ints = np.array([50, 100, 200, 250, 1000]) * NS_PER_MS

BYTES = {"cam": 50, "cpm": 120, "denm": 50, "mapem": 210, "spatem": 44, "srem": 45, "ssem": 350}
"""Typical UPER size of each kind in a small city; that of a CPM, which has no UPER, is a guess."""
# MAC 30, LLC 8, GeoNetworking 4 + 8 + 28, BTP 4, and a signature with the certificate's digest.
OVERHEAD_BYTES = 82 + 96

_PREAMBLE_S, _SYMBOL_S = 40e-6, 8e-6
_SPREAD = 0.618034


def air_time(kind: str, data_rate_mbps: float) -> float:
    """Return the air time of a frame [s]; 0 on a channel of unlimited rate."""
    if data_rate_mbps <= 0.0:
        return 0.0
    bits = 16 + 8 * (BYTES[kind] + OVERHEAD_BYTES) + 6
    return _PREAMBLE_S + _SYMBOL_S * math.ceil(bits / (1e6 * data_rate_mbps * _SYMBOL_S))


def load_loss(offered: Floats, hidden_share: float) -> Floats:
    """Return the share of frames lost to a busy channel at each place.

        1 - exp(-2 h c) min(1, 1 / c)      c: offered load, h: share of hidden senders

    Frames of senders that do not receive each other collide as in pure ALOHA (Abramson 1970); load
    beyond the channel's capacity is never sent.
    """
    fits = np.minimum(1.0, 1.0 / np.maximum(offered, 1e-9))
    lost: Floats = 1.0 - np.exp(-2.0 * hidden_share * offered) * fits
    return lost


class ReactiveControl:
    """Congestion control of some stations; update it with the busy ratio of every window.

    Each station waits for its own time of 4 to 6 s before it sends more often; otherwise all would
    switch at once and oscillate.

    Attributes:
        gap_ns: (n,) minimum time between two frames of each.
    """

    def __init__(self, count: int) -> None:
        self._state = np.zeros(count, np.int64)
        self._above_ns = np.zeros(count, np.int64)
        own = np.arange(count) * _SPREAD % 1.0
        self._down_ns = (RELAX_AFTER_NS * (0.8 + 0.4 * own)).astype(np.int64)
        self.gap_ns: Ints = GAPS_NS[self._state]

    def update(self, ratio: Floats, now_ns: int) -> None:
        """Update with the busy ratio (n,) of the window that ends now."""
        state = self._state
        up = ratio > LIMITS[state]
        below = LIMITS[np.maximum(state - 1, 0)]
        self._above_ns[ratio > below] = now_ns
        down = ~up & (state > 0) & (now_ns - self._above_ns >= self._down_ns)
        self._above_ns[up | down] = now_ns
        self._state = state + up - down
        self.gap_ns = GAPS_NS[self._state]


class StationControl:
    """Congestion control of one station: by a reported busy ratio, or by the frames it receives.

    Received frames underestimate the load: lost frames and kinds that it does not subscribe to are
    missing.

    Args:
        data_rate_mbps: Of the channel; 0: unlimited, it is never busy.
        is_on: Whether congestion control is active; otherwise the gap is 0.
    """

    def __init__(self, data_rate_mbps: float, *, is_on: bool) -> None:
        self._rate_mbps = data_rate_mbps
        self._control = ReactiveControl(1) if is_on else None
        self._window_ns: int | None = None
        self._air_s = self._last_ratio = 0.0
        self._reported: tuple[float, int] | None = None

    def set_ratio(self, ratio: float, now_ns: int) -> None:
        """Set the busy ratio measured at the station's place."""
        self._reported = ratio, now_ns

    def add_frame(self, kind: str, now_ns: int) -> None:
        """Add a received or sent frame to the channel load."""
        self._update(now_ns)
        self._air_s += air_time(kind, self._rate_mbps)

    def gap_ns(self, now_ns: int) -> int:
        """Return the minimum time between two frames [ns]."""
        if self._control is None:
            return 0
        self._update(now_ns)
        return int(self._control.gap_ns[0])

    def _update(self, now_ns: int) -> None:
        if self._window_ns is None:
            self._window_ns = now_ns
        span_ns = now_ns - self._window_ns
        if self._control is None or span_ns < WINDOW_NS:
            return
        now = self._air_s * NS_PER_S / span_ns
        ratio, self._last_ratio = 0.5 * (self._last_ratio + now), now
        self._window_ns, self._air_s = now_ns, 0.0
        if self._reported is not None and now_ns - self._reported[1] <= REPORT_VALID_NS:
            ratio = self._reported[0]
        self._control.update(np.array([ratio]), now_ns)
