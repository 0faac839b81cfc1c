"""What can still be concluded of a recording that allows no verdict on the car."""

from collections.abc import Sequence

from scm.data_quality.problem import DataProblem
from scm.data_quality.suspicion import Relation, Suspicion

MOST = 3
OTHER_CAR = "the car file is another car's"
WORDS = {"imu.gyro_z": "gyro", "encoder.*": "encoders", "imu.accel_x": "accelerometer"}
ANOTHER = "Nothing: give the file of the car that was driven."
RECORD = (
    "One drive of 60 s or more: poses at 20 Hz or more, throttle and steering as they are sent to "
    "the car, with starts, stops, both turns and several speeds."
)


def no_verdict(
    lacks: Sequence[str], relations: Sequence[Relation], suspicions: Sequence[Suspicion]
) -> DataProblem:
    """Return why there is no verdict, what the sensors say nevertheless, and what to record.

    Args:
        lacks: What keeps the recording from being driven again.
        relations: Sensors that were held against each other.
        suspicions: What that made suspicious, most certain first.
    """
    return DataProblem(
        channel="*",
        name="no_verdict",
        text=f"The car cannot be judged: {'; '.join(lacks)}. {_still(relations, suspicions)}",
        record_instead=ANOTHER if list(lacks) == [OTHER_CAR] else RECORD,
    )


def _still(relations: Sequence[Relation], suspicions: Sequence[Suspicion]) -> str:
    others = [relation.pair[1] for relation in relations if not relation.pair[1].startswith("pose")]
    if not others:
        return "No other sensor shows the poses' motion for long enough to be held against them."
    named = ", ".join(dict.fromkeys(WORDS.get(name, name) for name in others))
    sentences = list(dict.fromkeys(s.text for s in suspicions if s.text and not s.repaired))
    if not sentences:
        return f"What can still be said: the poses agree with {named}."
    return f"What can still be said: {' '.join(sentences[:MOST])}"
