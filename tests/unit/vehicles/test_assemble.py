import importlib
import re
from dataclasses import replace

import pytest

from scm.errors import RunError, TermError
from scm.vehicles.car import STANDARD_TERMS, all_terms, load_car
from scm.vehicles.compiler.assemble import setters_of, write_page
from scm.vehicles.compiler.kernel_file import compile_kernel
from scm.vehicles.fleet import Fleet
from scm.vehicles.param import Param
from scm.vehicles.physics_variables import VARIABLES, Per, Role
from scm.vehicles.term import Term
from tests.unit.vehicles.fresh import Compiling, small_car_after_a_second

STANDARD = [all_terms()[name] for name in STANDARD_TERMS]


def of(law, **facts):
    return Term(law, per=facts.pop("per", Per.BODY), **facts)


def test_an_unknown_name_is_refused_with_the_nearest_one():
    def wind(yaw_rat: float) -> float:
        return yaw_rat

    with pytest.raises(TermError, match=r"wind reads 'yaw_rat', .* mean 'yaw_rate'"):
        setters_of([*STANDARD, of(wind, adds="force_y")])


def test_two_setters_of_a_signal_are_refused_by_name():
    def other_servo(steer_target: float) -> float:
        return steer_target

    with pytest.raises(TermError, match="servo and other_servo both set servo_angle"):
        setters_of([*STANDARD, of(other_servo, sets="servo_angle")])


def test_a_signal_that_nobody_sets_is_refused():
    with pytest.raises(TermError, match="no term sets load"):
        setters_of([term for term in STANDARD if term.name != "tyre_contact"])


def test_an_effect_of_the_body_cannot_read_a_wheel():
    def lean(load: float) -> float:
        return load

    with pytest.raises(TermError, match="lean is once a body and cannot read load"):
        setters_of([*STANDARD, of(lean, adds="force_y")])


def test_a_sum_that_does_not_exist_is_refused_with_what_there_is():
    def lift(vx: float) -> float:
        return vx

    with pytest.raises(TermError, match=r"lift: 'force_up' .* one of force_x, force_y, moment_z"):
        setters_of([*STANDARD, of(lift, adds="force_up")])


def test_damping_is_refused_where_the_skeleton_is_not_implicit():
    def rotor(omega: float) -> float:
        return omega

    def rotor_damping(omega: float) -> float:
        return omega

    with pytest.raises(TermError, match="rotor: nothing damps extra_inertia"):
        setters_of(
            [*STANDARD, of(rotor, per=Per.WHEEL, adds="extra_inertia", damping=rotor_damping)]
        )


def test_effects_that_wait_for_each_other_are_named():
    def compliance(steer_angle: float) -> float:
        return steer_angle

    with pytest.raises(TermError, match=r"wait for each other: .*steer_target.*"):
        write_page([*STANDARD, of(compliance, sets="steer_target")])


def test_an_unset_signal_passes_on_the_one_before():
    page = write_page(STANDARD)
    assert "motor_dc_u = throttle_command * battery * (1.0 / motor_dc_battery_nominal)" in page
    lagged = write_page([*STANDARD, all_terms()["drive_lag"]])
    assert "motor_throttle = throttle\n" in lagged


def test_a_term_left_out_leaves_no_trace():
    page = write_page([term for term in STANDARD if term.name != "yaw_drag"])
    assert "yaw_drag" not in page


def test_the_order_of_the_list_does_not_change_the_order_of_sums():
    def sums(terms):
        lines = [line.strip() for line in write_page(terms).splitlines()]
        totals = {name for name, variable in VARIABLES.items() if variable.role is Role.SUM}
        return [line for line in lines if line.split(" = ")[0] in totals and " + " in line]

    assert sums(STANDARD) == sums(STANDARD[::-1])
    assert any(line.startswith("wheel_torque = ") for line in sums(STANDARD))


def test_terms_that_share_a_bare_parameter_name_keep_their_own_numbers():
    page = write_page(STANDARD)
    assert "\nTYRE_LATERAL_SLIP_EXTREMUM = " in page
    assert "\nTYRE_LONGITUDINAL_SLIP_EXTREMUM = " in page
    assert page.count("LOW_SPEED = ") == 1


def test_a_law_that_is_not_straight_line_text_is_refused_with_what_may_stand_there():
    def jumpy(vx: float) -> float:
        if vx > 0.0:
            return 1.0
        return 0.0

    with pytest.raises(
        TermError, match=r"\.py:\d+: function jumpy: expected straight.*'if vx > 0.0:'"
    ):
        write_page([*STANDARD, of(jumpy, adds="force_x")])


@pytest.mark.parametrize("line", ["vx and vy", "0.0 < vx < 1.0", "vx ** 2.0", "(vx, vy)[0]"])
def test_a_law_may_not_use_what_a_lane_cannot(line, tmp_path, monkeypatch):
    name = f"lane_{abs(hash(line))}"
    (tmp_path / f"{name}.py").write_text(f"def odd(vx, vy):\n    return {line}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    odd = importlib.import_module(name).odd
    with pytest.raises(TermError, match=r":2: function odd: expected straight-line text"):
        write_page([*STANDARD, of(odd, adds="force_x")])


def test_what_holds_still_during_a_call_is_worked_out_once():
    page = write_page(STANDARD)
    once, _, substep = page.partition("def effects_on_the_body")
    assert "per_tyre_lateral_slip_extremum = 1.0 / tyre_lateral_slip_extremum" in once
    assert "/ tyre_lateral_slip_extremum" not in substep


def test_a_term_of_somebody_else_joins_by_its_argument_names(tmp_path, monkeypatch):
    (tmp_path / "side_wind.py").write_text(
        "from scm.vehicles.jit import kernel_function\n\n\n"
        "@kernel_function\ndef side_wind(strength: float) -> float:\n    return strength\n",
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(tmp_path)
    import side_wind

    strength = Param("strength", 0.0, "N", "body.wind_n", (-5.0, 5.0), "from the right")
    term = of(side_wind.side_wind, adds="force_y", params=(strength,))
    page = write_page([*STANDARD, term])
    assert re.search(r"= .*contact_y.*side_wind_strength", page)


def test_cars_of_the_same_effects_share_one_kernel():
    nigel = load_car("nigel")
    other = replace(nigel, name="other", terms=tuple(nigel.terms))
    assert Fleet(other, 1)._kernel is Fleet(nigel, 1)._kernel


@pytest.mark.slow
def test_processes_that_compile_at_the_same_time_all_get_a_kernel(tmp_path):
    processes = [Compiling(small_car_after_a_second, tmp_path) for _ in range(2)]
    assert len({process.result() for process in processes}) == 1
    assert len(list(tmp_path.glob("*.py"))) == 1
    assert not list(tmp_path.glob("*.tmp"))


def test_a_cache_folder_that_cannot_be_written_is_refused_with_the_way_out(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    monkeypatch.setenv("SCM_CACHE_DIR", str(blocked / "cache"))
    few = [term for term in STANDARD if term.name not in {"aero_drag", "viscous_drag", "yaw_drag"}]
    with pytest.raises(RunError, match="set SCM_CACHE_DIR"):
        compile_kernel(few)
