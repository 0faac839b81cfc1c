import pytest

from scm.errors import TermError
from scm.vehicles.car import all_terms
from scm.vehicles.term import Per, Term, reads


def pull(vx: float, strength: float) -> float:
    return -strength * vx


def test_argument_names_are_the_wiring():
    assert reads(pull) == ("vx", "strength")
    assert reads(all_terms()["yaw_drag"].function) == ("yaw_rate", "coefficient")


def test_a_term_that_adds_and_sets_is_refused():
    with pytest.raises(TermError, match=r"pull: .* exactly one"):
        Term(pull, per=Per.BODY, adds="force_x", sets="throttle")
    with pytest.raises(TermError, match="exactly one"):
        Term(pull, per=Per.BODY)


def test_a_damping_law_must_carry_the_terms_name():
    with pytest.raises(TermError, match="named pull_damping, got pull"):
        Term(pull, per=Per.BODY, adds="force_x", damping=pull)


def test_documents_are_read_from_the_terms_file():
    term = all_terms()["rolling_resistance"]
    assert term.about.startswith("Rolling resistance")
    assert term.equation == "dry_torque += (c_rr + rolling) * load * wheel_radius    [N*m]"
    assert term.doc_line("Shows in") == "coast-down that stops too late."
