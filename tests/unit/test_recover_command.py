"""`scm recover` says what is no recording, and never writes over a file that somebody named."""

from scm.__main__ import main
from scm.commands.recover import MAGIC
from scm.recorder import recover as recovery
from scm.recorder.mcap_file import RunFile
from scm.v2x.exchange import RawSample
from scm.v2x.key import key_of
from scm.v2x.message import encode
from scm.v2x.messages.part_status import PartStatus


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
    assert "other.mcap already exists, expected a new name" in text
    assert other.read_bytes() == b"precious"


def test_a_run_that_is_still_being_written_is_copied_up_to_where_it_was(
    tmp_path, capsys, monkeypatch
):
    run, status = tmp_path / "run.mcap", PartStatus(station="eye", t_ns=0)
    sample = RawSample(key_of("city", status), *encode(status), t_ns=0)
    with RunFile(run, "city") as file:
        for _ in range(50):
            file.write(sample)
        file.flush()

        def copied_while_one_more_comes(copy, record, add=recovery._Copy.add):
            if copy.messages < 200:  # or it would never end
                file.write(sample)
                file.flush()
            add(copy, record)

        monkeypatch.setattr(recovery._Copy, "add", copied_while_one_more_comes)
        assert main(["recover", str(run)]) == 0
    told = capsys.readouterr().out
    assert "is still being written; up to the start of this command: 50 messages" in told
