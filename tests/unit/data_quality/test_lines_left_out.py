"""What was not read of a recording's files is reported, what is alike in one sentence."""

from scm.data_quality.prepare import MOST_REASONS, lines_left_out
from scm.recording.columns import LeftOut


def test_lines_that_are_alike_are_one_sentence():
    alike = [LeftOut("a.csv", line, "got 3 cells, expected 8") for line in (7, 9, 12, 30, 31)]
    others = [LeftOut("a.csv", 40, "t: got 'x'"), LeftOut("b.bag", None, "is cut off")]
    assert lines_left_out([*alike, *others]) == (
        "a.csv: lines 7, 9, 12 and 2 more: got 3 cells, expected 8",
        "a.csv: line 40: t: got 'x'",
        "b.bag: is cut off",
    )


def test_a_file_of_something_else_is_not_listed_line_by_line():
    said = lines_left_out(LeftOut("a.csv", line, f"got '{line}'") for line in range(1, 201))
    assert len(said) == MOST_REASONS + 1
    assert said[-1] == "and 190 more lines that are no rows"
