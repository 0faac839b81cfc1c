"""Every fault is injected into a stream of signal phases, and found; a healthy stream is not."""

import msgspec
import pytest

from scm.clock import NS_PER_MS
from scm.records.signals import SignalGroup
from scm.traffic.monitor.checks import Monitor
from scm.traffic.monitor.conflict_table import ConflictTable, GroupLimits
from scm.v2x.messages.spat import Spat

MS = NS_PER_MS
TIMES = {"green_ns": 1000 * MS, "yellow_ns": 560 * MS, "clearance_ns": 2000 * MS}
CARD = ConflictTable(
    junction="x",
    groups=tuple(GroupLimits(name=name, **TIMES) for name in "ab"),
    conflicts=(("a", "b"),),
)
LETTER = {"r": "red", "g": "green", "y": "yellow", "f": "flashing_red", "-": "dark"}


def spat(t_ms, *groups, junction="x"):
    shown = tuple(
        SignalGroup(group=name, colour=LETTER[letter], since_ns=0, min_end_ns=0)
        for name, letter in groups
    )
    return Spat(junction=junction, t_ns=t_ms * MS, seq=0, mode="plan", plan="p", groups=shown)


def stream(a, b):
    """Two strings of letters, one letter a sample of 100 ms; a blank is a lost sample."""
    for k, (left, right) in enumerate(zip(a, b, strict=True)):
        if left != " ":
            yield spat(100 * k, ("a", left), ("b", right))
        else:
            yield None


def watch(samples, offset_ms=0, card=CARD):
    monitor = Monitor(card, offset_ms * MS)
    for k, sample in enumerate(samples):
        now_ns = (100 * k + offset_ms) * MS
        if sample is not None:
            monitor.see(sample, now_ns)
        monitor.tick(now_ns)
    return monitor


def shown(*phases):
    return "".join(letter * count for letter, count in phases)


GOOD_A = shown(("r", 5), ("g", 12), ("y", 6), ("r", 60), ("g", 12), ("y", 6), ("r", 1))
GOOD_B = shown(("r", 43), ("g", 12), ("y", 6), ("r", 41))


def test_a_healthy_cycle_is_no_fault():
    assert watch(stream(GOOD_A, GOOD_B)).fault is None


def test_the_least_times_seen_at_10_hz_are_no_fault():
    a = shown(("r", 2), ("g", 10), ("y", 6), ("r", 40))
    b = shown(("r", 38), ("g", 20))
    assert watch(stream(a, b)).fault is None


def test_a_monitor_that_wakes_in_the_middle_of_a_phase_does_not_judge_what_it_did_not_see():
    for start in range(len(GOOD_A) - 1):
        assert watch(stream(GOOD_A[start:], GOOD_B[start:])).fault is None


@pytest.mark.parametrize("lost", range(4, 96))
def test_lost_samples_excuse_and_never_accuse(lost):
    a = GOOD_A[:lost] + "   " + GOOD_A[lost + 3 :]
    assert watch(stream(a, GOOD_B)).fault is None


FAULTS = {
    "conflict": ("rrgggggg", "rrgggggg"),
    "dark": ("rr--rrrr", "rrrrrrrr"),
    "skipped_yellow": (shown(("r", 2), ("g", 12), ("r", 3)), "r" * 17),
    "short_yellow": (shown(("r", 2), ("g", 12), ("y", 4), ("r", 3)), "r" * 21),
    "short_green": (shown(("r", 2), ("g", 8), ("y", 6)), "r" * 16),
    "short_clearance": (
        shown(("r", 2), ("g", 12), ("y", 6), ("r", 20)),
        shown(("r", 37), ("g", 3)),
    ),
    "sequence": ("rrry", "rrrr"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_an_injected_fault_is_found_by_its_name(fault):
    monitor = watch(stream(*FAULTS[fault]))
    assert monitor.fault == fault
    assert monitor.detail


def test_the_other_group_is_watched_as_well():
    a, b = FAULTS["short_clearance"]
    assert watch(stream(b, a)).fault == "short_clearance"


def test_a_group_that_joins_one_that_goes_is_a_conflict():
    assert watch(stream("rgggggg", "rrrrrgg")).fault == "conflict"
    assert watch(stream("rrrrrgg", "rgggggg")).fault == "conflict"


def test_a_time_that_is_just_long_enough_is_no_fault():
    assert watch(stream("r" + "g" * 9 + "y", "r" * 11)).fault is None
    assert watch(stream("r" + "g" * 8 + "y", "r" * 10)).fault == "short_green"


def test_clearance_is_that_of_the_group_that_went_before():
    slow, quick = CARD.groups[0], msgspec.structs.replace(CARD.groups[1], clearance_ns=500 * MS)
    card = msgspec.structs.replace(CARD, groups=(slow, quick))
    after_quick = stream(shown(("r", 24), ("g", 1)), shown(("g", 12), ("y", 6), ("r", 7)))
    after_slow = stream(shown(("g", 12), ("y", 6), ("r", 7)), shown(("r", 24), ("g", 1)))
    assert watch(after_quick, card=card).fault is None
    assert watch(after_slow, card=card).fault == "short_clearance"


def test_flash_needs_no_yellow_but_green_after_flash_needs_all_red_first():
    a = shown(("r", 2), ("g", 12), ("f", 10), ("r", 30), ("g", 1))
    b = shown(("r", 14), ("f", 10), ("r", 31))
    assert watch(stream(a, b)).fault is None
    a = shown(("f", 10), ("r", 15), ("g", 1))
    assert watch(stream(a, shown(("f", 10), ("r", 16)))).fault == "short_clearance"
    assert watch(stream("ffg", "fff")).fault == "sequence"


def test_a_conflict_on_one_sample_is_suspected_and_on_the_second_latched_after_100_ms():
    samples = list(stream("rrgg", "rrgg"))
    assert watch(samples[:3]).fault is None
    monitor = watch(samples)
    assert (monitor.fault, monitor.since_ns) == ("conflict", 300 * MS)


def test_a_suspicion_is_forgotten_after_666_ms_without():
    assert watch(stream("r-rrrrrr-rr", "r" * 11)).fault is None
    assert watch(stream("r-rrrrr-rrr", "r" * 11)).fault == "dark"


def test_two_colours_for_one_group_are_dual_and_a_missing_group_is_dark():
    dual = [spat(100 * k, ("a", "r"), ("a", "y"), ("b", "r")) for k in range(1, 3)]
    missing = [spat(100 * k, ("a", "r")) for k in range(2)]
    assert watch([spat(0, ("a", "r"), ("b", "r")), *dual]).fault == "dual"
    assert watch(missing).fault == "dark"


def test_a_group_that_is_not_on_the_card_is_a_fault():
    samples = [spat(100 * k, ("a", "r"), ("b", "r"), ("c", "g")) for k in range(2)]
    assert watch(samples).fault == "card"


def test_silence_of_more_than_500_ms_is_stale():
    assert watch(stream("rr      r", "rrrrrrrrr")).fault == "stale"
    assert watch(stream("rr    rr", "rrrrrrrr")).fault is None


def busy(share):
    """Return a monitor whose process waits for a processor for a share of the time."""
    now = {"ms": 0}
    return Monitor(CARD, 0, lambda: round(share * now["ms"] * MS)), now


def drive(monitor, now, first_ms, last_ms, *, heard):
    for ms in range(first_ms, last_ms, 50):
        now["ms"] = ms
        if heard and ms % 100 == 0:
            monitor.see(spat(ms, ("a", "r"), ("b", "r")), ms * MS)
        monitor.tick(ms * MS)


def test_a_busy_computer_is_told_from_a_controller_that_froze_and_recovers():
    monitor, now = busy(0.3)
    drive(monitor, now, 0, 1000, heard=True)
    drive(monitor, now, 1000, 1700, heard=False)
    assert monitor.fault == "overload"
    assert "no signal phase for 550 ms: this computer is too busy" in monitor.detail
    assert "waited 165 ms for a processor" in monitor.detail
    drive(monitor, now, 1700, 6600, heard=True)
    assert monitor.fault == "overload"
    drive(monitor, now, 6600, 6900, heard=True)
    assert monitor.fault is None


def test_a_silence_of_five_seconds_is_stale_however_busy_the_computer_is():
    monitor, now = busy(0.3)
    drive(monitor, now, 0, 1000, heard=True)
    drive(monitor, now, 1000, 5800, heard=False)
    assert monitor.fault == "overload"
    drive(monitor, now, 5800, 6100, heard=False)
    assert monitor.fault == "stale"
    drive(monitor, now, 6100, 20_000, heard=True)
    assert monitor.fault == "stale"


def test_on_a_computer_with_time_to_spare_the_same_silence_is_stale():
    monitor, now = busy(0.01)
    drive(monitor, now, 0, 1000, heard=True)
    drive(monitor, now, 1000, 1700, heard=False)
    assert monitor.fault == "stale"
    drive(monitor, now, 1700, 20_000, heard=True)
    assert monitor.fault == "stale"


def test_an_overload_hides_no_other_fault():
    monitor, now = busy(0.3)
    drive(monitor, now, 0, 1000, heard=True)
    drive(monitor, now, 1000, 1700, heard=False)
    for ms in (1700, 1800):
        monitor.see(spat(ms, ("a", "g"), ("b", "g")), ms * MS)
    assert monitor.fault == "conflict"


def test_an_output_that_hangs_and_says_the_same_again_and_again_is_stale():
    before = [spat(100 * k, ("a", "r"), ("b", "r")) for k in range(3)]
    assert watch([*before, *[before[-1]] * 5]).fault is None
    assert watch([*before, *[before[-1]] * 6]).fault == "stale"


def test_a_controller_never_seen_has_five_seconds_and_its_silence_ends_with_its_first_word():
    monitor = watch([None] * 51)
    assert monitor.fault is None
    monitor.tick(5050 * MS)
    assert monitor.fault == "stale"
    monitor.see(spat(5100, ("a", "r"), ("b", "r")), 5100 * MS)
    assert monitor.fault is None


def test_a_monitor_that_slept_listens_anew_for_half_a_second_and_no_longer():
    monitor = watch(stream("rrr", "rrr"))
    for now in range(2000, 2501, 50):
        monitor.tick(now * MS)
    assert monitor.fault is None
    monitor.tick(2550 * MS)
    assert monitor.fault == "stale"


def test_time_stamps_that_go_back_are_a_clock_jump():
    samples = [*stream("rrrrr", "rrrrr"), spat(250, ("a", "r"), ("b", "r"))]
    assert watch(samples).fault == "clock_jump"


def test_time_stamps_that_run_ahead_are_a_clock_jump_and_late_arrival_is_not():
    ahead = [*stream("rrr", "rrr"), spat(900, ("a", "r"), ("b", "r"))]
    assert watch(ahead).fault == "clock_jump"
    monitor = watch(stream("rrr", "rrr"), offset_ms=10_000)
    for k in range(3, 12):
        monitor.see(spat(100 * k, ("a", "r"), ("b", "r")), (11_200 + k) * MS)
    monitor.see(spat(1300, ("a", "r"), ("b", "r")), 11_300 * MS)
    assert monitor.fault is None


def test_a_sample_that_comes_twice_counts_once():
    monitor = watch(stream("rrg", "rrg"))
    monitor.see(list(stream("rrg", "rrg"))[2], 210 * MS)
    assert monitor.fault is None


def test_a_fault_stays_with_its_first_name_until_reset_and_is_found_again():
    bad = list(stream("rrgg", "rrgg"))
    monitor = watch([*bad, *stream("rrrrrrrr", "rrrrrrrr")][:10])
    assert (monitor.fault, monitor.since_ns) == ("conflict", 300 * MS)
    for t_ms in (60_000, 60_050):
        monitor.tick(t_ms * MS)
    assert monitor.fault == "conflict"
    monitor.reset(2000 * MS)
    assert (monitor.fault, monitor.detail, monitor.since_ns) == (None, "", 2000 * MS)
    for k in (20, 21):
        monitor.see(spat(100 * k, ("a", "g"), ("b", "g")), 100 * k * MS)
    assert monitor.fault == "conflict"
