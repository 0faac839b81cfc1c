"""`scm recover` says what is no recording, and never writes over a file that somebody named."""

from scm.__main__ import main
from scm.commands.recover import MAGIC


def said(capsys, *words):
    code = main(["recover", *map(str, words)])
    return code, capsys.readouterr().err


def test_a_file_that_is_no_recording_is_told_from_one_that_was_cut_off(tmp_path, capsys):
    table, cut = tmp_path / "rush.csv", tmp_path / "cut.mcap"
    table.write_text("from,to\n")
    cut.write_bytes(MAGIC + b"\x01")
    code, text = said(capsys, table)
    assert code != 0
    assert "rush.csv: got a file that does not begin as an .mcap" in text
    assert "holds no whole message" in said(capsys, cut)[1]


def test_a_file_that_is_there_is_not_written_over(tmp_path, capsys):
    cut, other = tmp_path / "cut.mcap", tmp_path / "other.mcap"
    cut.write_bytes(MAGIC)
    other.write_bytes(b"precious")
    code, text = said(capsys, cut, "--out", other)
    assert code != 0
    assert "other.mcap is there already, expected a new name" in text
    assert other.read_bytes() == b"precious"
