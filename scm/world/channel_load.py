"""How busy the channel is where each station is: frames on the air, measured over 100 ms."""

from collections.abc import Mapping, Sequence

import numpy as np

from scm.arrays import Bools, Floats
from scm.records.city_map import Point, RadioChannel
from scm.v2x.congestion import WINDOW_NS, ReactiveControl, air_time, load_loss
from scm.vehicles.drivers.channel import add_busy_time

OnAir = tuple[Floats, Floats, Floats]


class ChannelLoad:
    """The load of the one channel; on an endless one nothing is measured.

    Attributes:
        ratio: (capacity,) by vehicle index, of the last two windows; 0: unknown.
        lost: (capacity,) share of frames that each loses to the load.
        control: How often each may send; None: as the rule for CAMs allows.
    """

    def __init__(self, radio: RadioChannel, range_m: float, lost: Floats) -> None:
        self._radio = radio
        self._range_m = range_m
        self._frames: list[OnAir] = []
        self._window_ns = 0
        self._offered = np.zeros(len(lost))
        self.ratio = np.zeros(len(lost))
        self.lost = lost
        self.control = ReactiveControl(len(lost)) if radio.congestion_control else None
        self.is_measured = radio.data_rate_mbps > 0.0
        self._others: dict[str, tuple[float, float]] = {}

    def note(self, kind: str, x: Floats, y: Floats) -> None:
        """Add frames of a kind that are sent from places (k,)."""
        if self.is_measured:
            air_s = np.full(len(x), air_time(kind, self._radio.data_rate_mbps))
            self._frames.append((np.array(x), np.array(y), air_s))

    def is_due(self, now_ns: int) -> bool:
        """Return whether a window has ended."""
        return self.is_measured and now_ns - self._window_ns >= WINDOW_NS

    def measure(
        self, now_ns: int, x: Floats, y: Floats, hosted: Bools, others: Mapping[str, Point]
    ) -> None:
        """End a window.

        Args:
            now_ns: The present time [ns].
            x: By vehicle index [m]; likewise `y`.
            y: See `x`.
            hosted: Which indices are hosted cars.
            others: Where the antennas of all other stations are.
        """
        span_s = 1e-9 * (now_ns - self._window_ns)
        self._window_ns = now_ns
        sent = self._frames or [(np.zeros(0), np.zeros(0), np.zeros(0))]
        at_x, at_y, air_s = (np.concatenate(column) for column in zip(*sent, strict=True))
        frames = (at_x, at_y, air_s)
        self._frames = []
        before, self._offered = self._offered, np.zeros(len(x))
        add_busy_time(self._range_m, *frames, x, y, hosted, self._offered)
        self._offered /= span_s
        mean = 0.5 * (before + self._offered)
        self.ratio = np.minimum(mean, 1.0)
        self.lost[:] = load_loss(mean, self._radio.hidden_share)
        self._measure_others(frames, others, span_s)
        if self.control is not None:
            self.control.update(self.ratio, now_ns)

    def loss_of(self, names: Sequence[str]) -> Floats:
        """Return the share of frames that stations that are not hosted lose to the load (n,)."""
        offered = np.array([self._others.get(name, (0.0, 0.0)) for name in names])
        return load_loss(offered.reshape(-1, 2).mean(axis=1), self._radio.hidden_share)

    def ratio_of(self, name: str) -> float:
        """Return how busy the channel is at a station that is not hosted."""
        return min(1.0, sum(self._others.get(name, (0.0, 0.0))) / 2.0)

    def _measure_others(
        self,
        frames: OnAir,
        others: Mapping[str, Point],
        span_s: float,
    ) -> None:
        places = np.array(list(others.values())).reshape(-1, 2)
        busy = np.zeros(len(places))
        all_of_them = np.ones(len(places), np.bool_)
        x, y = np.ascontiguousarray(places[:, 0]), np.ascontiguousarray(places[:, 1])
        add_busy_time(self._range_m, *frames, x, y, all_of_them, busy)
        known = self._others
        self._others = {
            name: (known.get(name, (0.0, 0.0))[1], float(now / span_s))
            for name, now in zip(others, busy, strict=True)
        }
