"""What the firmware's telemetry means."""

from vehicle_agent.nigel.telemetry import telemetry_of, unwrapped


def reading(left, right):
    return telemetry_of([left, right, 0.1, 0.2, 0.3, 11.1, 1.0, 20.0])


def test_counts_go_on_where_the_firmware_wraps_them():
    before = unwrapped(reading(2**23 - 2, -(2**23) + 1), None)
    after = unwrapped(reading(-(2**23) + 3, 2**23 - 4), before)
    assert (after.left - before.left, after.right - before.right) == (5, -5)
    later = unwrapped(reading(-(2**23) + 10, 2**23 - 9), after)
    assert (later.left - after.left, later.right - after.right) == (7, -5)
    assert later.battery_v == 11.1


def test_the_first_reading_is_taken_as_it_is():
    assert unwrapped(reading(7, -7), None) == reading(7, -7)
