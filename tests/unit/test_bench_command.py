"""`python -m bench NAME --help`: what takes minutes says first how it is asked."""

import sys

import pytest

from bench.__main__ import LONG, main


@pytest.mark.parametrize("name", LONG)
def test_a_long_benchmark_explains_itself_and_measures_nothing(name, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bench", name, "--help"])
    with pytest.raises(SystemExit) as ended:
        main(sys.argv[1:])
    assert ended.value.code == 0
    assert "usage: python -m bench" in capsys.readouterr().out
