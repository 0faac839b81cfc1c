"""Events of one kind are one row on the events page; nothing is dropped, no error is hidden."""

import json
import shutil
import subprocess

import pytest

from scm.api.dashboard import STATIC_DIR

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="it runs the page's own script in Node.js")
FOLDING = STATIC_DIR / "js/pages/events/folding.js"
ASK = "import { folded } from './folding.mjs'; import { readFileSync } from 'node:fs';"
SHOW = "console.log(JSON.stringify(folded(JSON.parse(readFileSync(0, 'utf8')))));"


def event(t_s, name="hard_braking", vehicle="n1", severity="warning", text="", source="observer"):
    said = text or f"{vehicle} {name}"
    return {
        "id": f"{t_s}-{vehicle}-{name}", "t_ns": round(t_s * 1e9), "name": name,
        "vehicle": vehicle, "severity": severity, "source": source, "text": said,
    }  # fmt: skip


@pytest.fixture(scope="module")
def folded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("script")
    shutil.copy(FOLDING, folder / "folding.mjs")

    def fold(events):
        told = json.dumps(sorted(events, key=lambda one: -one["t_ns"]))
        command = [NODE, "--input-type=module", "-e", ASK + SHOW]
        return json.loads(
            subprocess.run(
                command, cwd=folder, input=told, capture_output=True, check=True, text=True
            ).stdout
        )

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
