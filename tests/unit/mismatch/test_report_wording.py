"""Numbers and names as a report prints them."""

import pytest

from scm.mismatch.findings import Estimate, Range
from scm.mismatch.report.sentences import range_sentence, sensors
from scm.mismatch.report.wording import interval, pretty, quantities, short
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_up_findings import replace


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        ((0.0566, 0.0027, 0.00137), "m", ["5.66 cm", "0.27 cm", "0.14 cm"]),
        ((0.257, 0.0078, 0.00042), "rad", ["14.7°", "0.45°", "0.024°"]),
        ((0.0, 0.0), "m", ["0 mm", "0 mm"]),
        ((2.16, float("nan")), "m", ["2.16 m", "unknown"]),
        ((-0.5, 0.25), "m/s", ["\N{MINUS SIGN}0.500 m/s", "0.250 m/s"]),
    ],
)
def test_numbers_to_be_compared_share_a_unit(values, unit, said):
    assert quantities(values, unit) == said


@pytest.mark.parametrize(
    ("value", "low", "high", "unit", "said"),
    [
        (1.03162, 1.02874, 1.0345, "1", "1.0316 (90 %: 1.0287 to 1.0345)"),
        (0.12562, 0.1197, 0.1316, "1", "0.126 (90 %: 0.120 to 0.132)"),
        (0.063847, 0.061844, 0.065851, "rad",
         "0.0638 rad = 3.66° (90 %: 0.0618 to 0.0659)"),
        (2.0, 2.0, 2.0, "kg", "2 kg (90 %: 2 to 2)"),
        (1523.4, 1100.0, 1950.0, "N", "1520 N (90 %: 1100 to 1950)"),
    ],
)  # fmt: skip
def test_an_interval_shows_as_many_digits_as_its_width_allows(value, low, high, unit, said):
    assert interval(Estimate(value=value, low=low, high=high, unit=unit)) == said


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (2500.0, "2500"),
        (1234567.0, "1.23·10⁶"),
        (-2.13e-7, "\N{MINUS SIGN}2.13·10⁻⁷"),
        (0.5, "0.5"),
    ],
)
def test_no_number_is_printed_as_a_computer_writes_it(value, said):
    assert short(value) == said


def test_a_sensor_is_named_once_whatever_its_channels():
    channels = ("imu.gyro_z", "encoder.left", "encoder.right", "pose.x", "pose.y")
    assert sensors(channels) == "gyro, encoders and measured position"


def test_one_encoder_alone_is_told_from_the_other():
    assert sensors(("encoder.left",)) == "left encoder"


def test_a_channel_without_a_name_keeps_its_own():
    assert sensors(("light.front",)) == "light.front"


def test_units_and_signs_of_a_sentence_are_printed_ones():
    assert (
        pretty("off by -0.03 rad s^2/m, slow-ly") == "off by \N{MINUS SIGN}0.03 rad s²/m, slow-ly"
    )


def test_a_range_is_one_short_sentence_with_each_unit_once():
    ranges = {"speed": Range(low=0.2, high=0.912, unit="m/s"),
              "throttle": Range(low=0.1, high=0.8, unit="1")}  # fmt: skip
    effect = replace(made_up.lag(), recorded_range=ranges)
    sentence = "Seen at speed 0.200 to 0.912 m/s and throttle 0.100 to 0.800."
    assert range_sentence(effect) == sentence
    assert range_sentence(made_up.lag()) == ""
