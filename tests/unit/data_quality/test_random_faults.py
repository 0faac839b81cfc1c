"""Nobody is misled by a spoilt recording: a few of the draws of `bench/recording_faults.py`."""

import pytest

from bench.recording_faults import FAULTS, tried


@pytest.mark.parametrize("seed", [*range(20), 5565, 21821])  # the last two: shuffled rows
def test_a_spoilt_recording_replays_as_the_clean_one_or_a_sentence_names_the_change(seed):
    outcome = tried(seed)
    assert outcome.is_right, f"{outcome.kind}: {', '.join(outcome.faults)}: {outcome.text}"


def test_there_are_faults_of_every_kind():
    names = {fault.__name__ for fault in FAULTS}
    assert {"shuffled", "repeated", "paused", "stray", "wrapped", "restarted", "dialect"} <= names
