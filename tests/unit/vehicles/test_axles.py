"""What one axle makes plain falls away from its wheels' lines."""

import ast
from collections import Counter

from scm.vehicles.car import load_car
from scm.vehicles.compiler.assemble import write_page
from scm.vehicles.compiler.axles import AXLES, Known
from scm.vehicles.compiler.inline import Line

LINES = (
    "slope = front * long * road / (long - road)",
    "cosine = 1.0 / sqrt(1.0 + slope * slope)",
    "along = cosine * over_x + slope * over_y",
    "axle = axle_front if front > 0.5 else axle_rear",
)


def folded(axle: int, lines: tuple[str, ...] = LINES, stored: tuple[str, ...] = ()) -> list[str]:
    parsed: list[Line] = []
    for text in lines:
        name, _, value = text.partition(" = ")
        parsed.append((name, ast.parse(value, mode="eval").body))
    known = Known(AXLES[axle], Counter(name for name, _ in parsed), set(stored))
    return [f"{name} = {ast.unparse(value)}" for name, value in known.fold(parsed)]


def test_a_wheel_that_cannot_steer_needs_no_angle() -> None:
    assert folded(1) == ["along = over_x", "axle = axle_rear"]


def test_a_wheel_that_steers_keeps_its_lines() -> None:
    assert folded(0) == [
        "slope = long * road / (long - road)",
        "cosine = 1.0 / sqrt(1.0 + slope * slope)",
        "along = cosine * over_x + slope * over_y",
        "axle = axle_front",
    ]


def test_what_others_read_after_the_call_keeps_its_line() -> None:
    assert folded(1, stored=("slope",))[0] == "slope = 0.0"


def test_a_name_with_two_lines_is_never_taken_for_a_number() -> None:
    assert folded(1, ("spin = front", "spin = spin + push")) == ["spin = 0.0", "spin = spin + push"]


def test_only_front_wheels_of_a_car_take_a_root_for_their_angle() -> None:
    car = load_car("nigel")
    page = write_page(car.terms)
    front, rear = (
        page.index("effects_on_each_front_wheel"),
        page.index("effects_on_each_rear_wheel"),
    )
    assert "np.sqrt(" in page[front:rear]
    assert "np.sqrt(" not in page[rear : page.index("one_implicit_step")]
