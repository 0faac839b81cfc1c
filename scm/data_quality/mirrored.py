"""A recording that runs backwards in time: every rate has the wrong sign, no position has."""

from collections.abc import Iterable

from scm.data_quality.mend import GYROS
from scm.data_quality.problem import DataProblem


def mirrored(problems: Iterable[DataProblem]) -> DataProblem | None:
    """Return that time runs backwards, where both gyro and throttle had to be turned round.

    Stamps that count down make a car drive backwards at positive throttle and turn against its
    gyro, while its encoders, which go back too, agree with its way.
    """
    turned = {problem.channel for problem in problems if problem.name == "sign"}
    if "command.throttle" not in turned or not turned.intersection(GYROS):
        return None
    return DataProblem(
        channel="*",
        name="time_backwards",
        text="Gyro and throttle both have the wrong sign against the motion, as in a recording "
        "that runs backwards in time: causes would come after what they cause.",
        record_instead="Write stamps that count up, and rows as they come.",
    )
