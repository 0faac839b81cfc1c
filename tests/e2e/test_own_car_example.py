"""The example of an own car with an own effect runs as its file says."""

import re
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_car"


def test_the_example_shows_what_the_own_effect_does():
    command = [sys.executable, str(EXAMPLE / "drive.py")]
    text = subprocess.run(command, capture_output=True, text=True, check=True, timeout=280).stdout
    slow, fast, plain, _ = (float(number) for number in re.findall(r"\d\.\d+", text))
    assert slow < 0.8 * fast
    assert fast < plain


def test_each_file_of_the_example_is_short_enough_to_copy():
    for file in EXAMPLE.glob("*.*"):
        assert len(file.read_text(encoding="utf-8").splitlines()) < 60, file.name
