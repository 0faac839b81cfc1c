"""Air times of frames, what a full channel costs, and cars that speak less when it is busy."""

import numpy as np
import pytest

from scm.clock import NS_PER_MS
from scm.v2x.congestion import (
    ACTIVE_3_LIMIT,
    BYTES,
    OVERHEAD_BYTES,
    WINDOW_NS,
    ReactiveControl,
    StationControl,
    air_time,
    load_loss,
)


def test_a_frame_takes_the_preamble_and_whole_symbols():
    symbols = -(-(22 + 8 * (BYTES["cam"] + OVERHEAD_BYTES)) // 48)
    assert air_time("cam", 6.0) == pytest.approx(40e-6 + 8e-6 * symbols)
    assert air_time("cam", 0.0) == 0.0


def test_a_channel_without_hidden_nodes_loses_only_the_excess_load():
    lost = load_loss(np.array([0.0, 0.9, 2.0]), 0.0)
    assert lost == pytest.approx([0.0, 0.0, 0.5])


def test_hidden_senders_collide_as_in_aloha():
    assert load_loss(np.array([0.5]), 0.4) == pytest.approx(1.0 - np.exp(-0.4))


def test_a_busy_channel_reduces_the_message_rate_step_by_step():
    control = ReactiveControl(1)
    gaps = []
    for window in range(5):
        control.update(np.array([0.7]), window * WINDOW_NS)
        gaps.append(control.gap_ns[0] // NS_PER_MS)
    assert gaps == [100, 200, 250, 1000, 1000]


def test_a_quiet_channel_raises_the_message_rate_after_five_seconds():
    control = ReactiveControl(1)
    control.update(np.array([0.35]), 0)
    for window in range(1, 40):
        control.update(np.array([0.1]), window * WINDOW_NS)
    assert control.gap_ns[0] == 100 * NS_PER_MS
    for window in range(40, 62):
        control.update(np.array([0.1]), window * WINDOW_NS)
    assert control.gap_ns[0] == 50 * NS_PER_MS


def closed_loop(cars, windows, *, controlled):
    """Return the ratios of two windows each where all cars hear each other and want 10 Hz."""
    control, cam_s = ReactiveControl(cars), air_time("cam", 6.0)
    sent_ns = -np.arange(cars) * NS_PER_MS
    ratios, before = [], 0.0
    for tick in range(5 * windows):
        now_ns = tick * WINDOW_NS // 5
        gap_ns = np.maximum(WINDOW_NS, control.gap_ns) if controlled else WINDOW_NS
        due = now_ns - sent_ns >= gap_ns
        sent_ns[due] = now_ns
        before += due.sum() * cam_s
        if tick % 5 == 4:
            ratios.append(before / (WINDOW_NS * 1e-9))
            control.update(np.full(cars, min(1.0, np.mean(ratios[-2:]))), now_ns)
            before = 0.0
    return 0.5 * (np.array(ratios[20:]) + np.array(ratios[19:-1]))


def test_control_keeps_two_hundred_cars_in_range_under_the_target():
    assert closed_loop(200, 300, controlled=False).min() > ACTIVE_3_LIMIT
    ratios = closed_loop(200, 300, controlled=True)
    assert ratios.mean() < ACTIVE_3_LIMIT
    assert np.mean(ratios > ACTIVE_3_LIMIT) < 0.05


def alone(frames_a_window, *, is_on=True, reported_ratio=None, seconds=3.0, told_until_s=np.inf):
    """Return the gap [ms] of a station that hears so many CAMs in 100 ms, told every second."""
    control = StationControl(6.0, is_on=is_on)
    for step in range(round(seconds * 100)):
        now_ns = step * 10 * NS_PER_MS
        for _ in range(frames_a_window // 10):
            control.add_frame("cam", now_ns)
        if reported_ratio is not None and step % 100 == 0 and step < 100 * told_until_s:
            control.set_ratio(reported_ratio, now_ns)
        gap = control.gap_ns(now_ns) / NS_PER_MS
    return gap


def test_without_reports_a_station_uses_the_load_it_receives():
    assert alone(0) == 50
    assert alone(100) == 100, "100 CAMs of 0.35 ms in 100 ms are 0.35"
    assert alone(130) == 200
    assert alone(130, is_on=False) == 0


def test_a_fresh_report_has_priority_over_the_received_load():
    assert alone(0, reported_ratio=0.45) == 200
    assert alone(130, reported_ratio=0.1) == 50
    assert alone(130, reported_ratio=0.1, seconds=6.0, told_until_s=2.0) == 200
