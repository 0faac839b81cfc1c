"""The study that docs/studies.md shows is one that runs."""

import re
from pathlib import Path

from scm.study.loaded_study import load

PAGE = Path(__file__).parents[3] / "docs" / "studies.md"


def test_the_example_of_the_documentation_runs_as_it_stands(tmp_path):
    text = PAGE.read_text("utf-8")
    for language, name in (("python", "laps.py"), ("toml", "laps.toml")):
        (found,) = re.findall(rf"```{language}\n# {re.escape(name)}\n(.*?)```", text, re.DOTALL)
        (tmp_path / name).write_text(found)
    study = load(tmp_path / "laps.toml")
    assert len(study.design) == 30
    row = study.run(1)
    assert (row.detail, row.outcome) == ("", "success")
    assert 20.0 < row.measures["travel_time_s"] < 45.0
