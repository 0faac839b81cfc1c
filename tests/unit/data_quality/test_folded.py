"""Twelve equal remarks are one line."""

from scm.data_quality.quality import DataProblem, folded


def lost(channel: str, rows: int = 3) -> DataProblem:
    return DataProblem(
        channel=channel, name="not_finite", text=f"{rows} of 1500 rows hold no number."
    )


def test_problems_that_say_the_same_of_two_channels_are_one() -> None:
    (one,) = folded([lost("pose.x"), lost("pose.y")])
    assert one.channel == "pose.x, pose.y"
    assert one.text == "3 of 1500 rows hold no number."


def test_of_many_channels_their_number_is_given() -> None:
    names = [f"imu.{kind}_{axis}" for kind in ("accel", "gyro") for axis in "xyz"]
    names += ["pose.x", "pose.y", "pose.yaw", "speed", "encoder.left", "encoder.right"]
    (one,) = folded(map(lost, names))
    assert one.channel == "12 channels (imu.*, pose.*, speed, encoder.*)"


def test_what_differs_stays_apart_and_in_order() -> None:
    found = folded([lost("pose.x"), lost("pose.y", 4), lost("speed")])
    assert [p.channel for p in found] == ["pose.x, speed", "pose.y"]


def test_the_same_problem_of_one_channel_is_named_once() -> None:
    assert [p.channel for p in folded([lost("speed"), lost("speed")])] == ["speed"]
