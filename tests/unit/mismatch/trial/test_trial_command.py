"""`scm trial` on the command line: what it refuses, and what its options mean."""

import pytest

from scm.__main__ import build_parser, main


def test_a_folder_without_cases_is_refused_by_name(tmp_path, capsys):
    assert main(["trial", "--trials", str(tmp_path)]) == 2
    assert "no case_*/drive/recording.yaml" in capsys.readouterr().err


def test_options_have_sensible_values_unasked():
    arguments = build_parser().parse_args(["trial"])
    assert (arguments.kind, arguments.engine, arguments.workers) == ("mixed", "own", 2)
    assert (arguments.family, arguments.half) == ("own", None)
    assert (arguments.cases, arguments.strength, arguments.live) == (None, None, False)


def test_a_half_of_usual_families_is_refused(tmp_path, capsys):
    assert main(["trial", "--out", str(tmp_path), "--cases", "1", "--half", "judge"]) == 2
    assert "--half needs --family drawn" in capsys.readouterr().err


def test_an_engine_that_is_not_there_is_refused(capsys):
    with pytest.raises(SystemExit):
        build_parser().parse_args(["trial", "--engine", "bullet"])
    assert "bullet" in capsys.readouterr().err
