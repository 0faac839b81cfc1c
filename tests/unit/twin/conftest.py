"""Tests of the twin share what is predicted of drives that they share."""

import hashlib
import pickle
from collections.abc import Iterator

import pytest

from scm.recording.read import Recording
from scm.twin.windows import WatchedCar, Windows


@pytest.fixture(autouse=True, scope="session")
def predicted_once() -> Iterator[None]:
    """Predict a span of a drive once for each car: it takes nearly all the time of these tests."""
    known, predict = dict[bytes, Windows](), WatchedCar.windows

    def windows(predictor: WatchedCar, recording: Recording) -> Windows:
        given = predictor.given
        key = given.path.read_bytes(), len(given.terms), given.values, recording
        digest = hashlib.sha256(pickle.dumps(key)).digest()
        if digest not in known:
            known[digest] = predict(predictor, recording)
            for array in (known[digest].misses, known[digest].slopes):
                array.flags.writeable = False  # all tests have the same
        return known[digest]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(WatchedCar, "windows", windows)
        yield
