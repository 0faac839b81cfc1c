"""What the pages' scripts work out: which events are one row, and where names stand beside cars."""

import json
import shutil
import subprocess

import pytest

from scm.api.dashboard import STATIC_DIR
from scm.scenery.bodies import PAINT

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="it runs the page's own script in Node.js")
JS = STATIC_DIR / "js"


def event(t_s, name="hard_braking", vehicle="n1", severity="warning", text="", source="observer"):
    said = text or f"{vehicle} {name}"
    return {
        "id": f"{t_s}-{vehicle}-{name}", "t_ns": round(t_s * 1e9), "name": name,
        "vehicle": vehicle, "severity": severity, "source": source, "text": said,
    }  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("script")

    def run(script, function, *arguments):
        """Return what a function of a page's script makes of its arguments."""
        shutil.copy(JS / script, folder / "script.mjs")
        ask = f"import {{ {function} }} from './script.mjs';"
        ask += "import { readFileSync } from 'node:fs';"
        show = f"console.log(JSON.stringify({function}(...JSON.parse(readFileSync(0, 'utf8')))));"
        command = [NODE, "--input-type=module", "-e", ask + show]
        given = json.dumps(arguments)
        done = subprocess.run(
            command, cwd=folder, input=given, capture_output=True, check=True, text=True
        )
        return json.loads(done.stdout)

    return run


@pytest.fixture
def folded(run):
    def fold(events):
        newest_first = sorted(events, key=lambda one: -one["t_ns"])
        return run("pages/events/folding.js", "folded", newest_first)

    return fold


def test_the_one_error_stands_between_two_rows_of_112_warnings(folded):
    brakings = [event(10.7 * n, vehicle=f"n{n % 5}") for n in range(112)]
    others = [event(600.0, "trip_ended", "n2", "info"), event(700.0, "lost", None, "error")]
    groups = folded([*brakings, *others])
    assert [(group["newest"]["name"], len(group["events"])) for group in groups] == [
        ("hard_braking", 112), ("lost", 1), ("trip_ended", 1),
    ]  # fmt: skip
    assert (groups[0]["newest"]["t_ns"], groups[0]["oldest"]["t_ns"]) == (1_187_700_000_000, 0)
    assert sorted(groups[0]["vehicles"]) == ["n0", "n1", "n2", "n3", "n4"]


def test_errors_are_never_folded(folded):
    assert len(folded([event(n, severity="error") for n in range(5)])) == 5


def test_after_five_calm_minutes_a_row_begins_anew(folded):
    groups = folded([event(0.0), event(300.0), event(600.5)])
    assert [len(group["events"]) for group in groups] == [1, 2]


def test_what_is_about_no_car_is_folded_only_while_the_same_is_said(folded):
    said = ["stop", "stop", "go", "stop"]
    events = [event(n, "city_stop", None, text=text) for n, text in enumerate(said)]
    groups = folded(events)
    assert [(group["newest"]["text"], len(group["events"])) for group in groups] == [
        ("stop", 1), ("go", 1), ("stop", 2),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("lamps", "place"),
    [
        ([], [100, 70]),
        ([[95, 60, 110, 75]], [100, 130]),
        ([[95, 60, 110, 75], [60, 120, 140, 140]], [150, 100]),
        ([[0, 0, 200, 200]], [100, 70]),
    ],
)
def test_a_name_stands_where_no_lamp_hides_it(run, lamps, place):
    found = run("shared/car_shape.js", "placeOf", [100, 100], [50, 30], [20, 9], lamps)
    assert found == place


def test_a_car_has_one_colour_on_the_map_and_in_the_eyes_picture(run):
    for kind, (blue, green, red) in PAINT.items():
        light, _dark = run("shared/car_shape.js", "paintOf", kind, True)
        assert light == f"#{red:02x}{green:02x}{blue:02x}"
    assert run("shared/car_shape.js", "paintOf", "real", False)[0] == "#8a929c"


@pytest.mark.parametrize(
    ("name", "values", "options", "expected"),
    [
        ("offset_rad", [-0.031, -0.0334, -0.0288, 0], {"width": 0.0046},
         ["-1.78°", "-1.91°", "-1.65°", "0.00°"]),
        ("position_m", [0.041, 0.0182], {}, ["4.10 cm", "1.82 cm"]),
        ("bias_rad_s", [-0.0115, None], {}, ["-0.659°/s", "—"]),
        ("gradient", [-1.6], {"unit": "rad*s^2/m"}, ["-1.60 rad·s²/m"]),
        ("gain", [0.875, 0.86], {"width": 0.02, "unit": "1"}, ["0.875", "0.860"]),
        ("torque_nm", [0.0], {}, ["0 N·m"]),
        ("delay_s", [0.04, 1.2], {}, ["0.04 s", "1.20 s"]),
    ],
)  # fmt: skip
def test_numbers_are_written_in_the_unit_in_which_their_name_ends(
    run, name, values, options, expected
):
    found = run("shared/amounts.js", "amounts", name, values, options)
    assert [text.replace("\N{MINUS SIGN}", "-") for text in found] == expected


@pytest.mark.parametrize(
    ("share", "expected"),
    [(1.0, "over 99.9 %"), (0.0, "under 0.1 %"), (0.97, "97 %"), (0.99, "99.0 %")],
)
def test_no_probability_is_certain(run, share, expected):
    assert run("shared/amounts.js", "percent", share) == expected
