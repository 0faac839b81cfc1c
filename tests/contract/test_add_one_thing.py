"""`docs/add_one_thing.md` is true: one of each is added by touching just the files that it names.

All are added to one copy of the packages; then one process imports each of them there and checks
that the program knows it, without running a city.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from inspect import cleandoc
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "add_one_thing.md"
STATIC = "scm/api/static"
THROTTLE = "    throttle: float | None = None"


def copy_of(path: str, *changes: tuple[str, str]) -> str:
    """Return the text of a file of the project with other words in some places."""
    text = (ROOT / path).read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, f"{path}: {old}"
        text = text.replace(old, new)
    return text


@dataclass(frozen=True, kw_only=True)
class Thing:
    """One thing to add, named as in the first column of the page's table.

    Attributes:
        files: Text of each new file.
        edits: Of each edited file: what stands there, and what stands there afterwards.
        check: Python that fails where the program does not know the thing.
    """

    files: Mapping[str, str] = field(default_factory=dict)
    edits: Mapping[str, Sequence[tuple[str, str]]] = field(default_factory=dict)
    check: str


THINGS = {
    "a physical effect": Thing(
        files={
            "scm/vehicles/terms/carpet_nap.py": copy_of(
                "examples/own_car/carpet_nap.py",
                ("from scm.vehicles.jit", "from scm.vehicles.identification import Identification\n"
                                          "from scm.vehicles.jit"),
                ("which the pile lies\"),\n    ),\n", "which the pile lies\"),\n    ),\n"
                 "    identification=Identification(\n"
                 "        equation=\"body\", depends_on=(\"heading\",), starts=((2.0, 0.0),),\n"
                 "        steps=(0.5, 0.1), sentence=\"A nap of {coefficient}.\",\n    ),\n"),
            ),
        },
        check="""
            import contextlib
            import io

            from scm.__main__ import main
            from scm.mismatch.effect_catalogue import candidates
            from scm.vehicles.car import load_car

            shown = io.StringIO()
            with contextlib.redirect_stdout(shown):
                assert main(["show", "terms"]) == 0
            assert "carpet_nap" in shown.getvalue()
            assert "carpet_nap" in {effect.name for effect in candidates(load_car("nigel"))}
        """,
    ),
    "a sensor fault of recordings": Thing(
        files={
            "scm/vehicles/sensor_faults/yaw_bias.py": copy_of(
                "scm/vehicles/sensor_faults/gyro_bias.py", ("gyro_bias", "yaw_bias")
            ),
        },
        check="""
            from scm.vehicles.sensor_fault import all_sensor_faults

            assert "yaw_bias" in all_sensor_faults()
        """,
    ),
    "a sensor": Thing(
        files={
            "scm/vehicles/sensors/brake_light.py": copy_of(
                "scm/vehicles/sensors/throttle_feedback.py",
                ("throttle_feedback", "brake_light"), ('"throttle"', '"brake_light"'),
            ),
        },
        edits={
            "scm/v2x/messages/vehicle_sensors.py": [
                (f"{THROTTLE}\n", f"{THROTTLE}\n    brake_light: float | None = None\n"),
            ],
        },
        check="""
            from pathlib import Path

            from scm.vehicles.car import load_car
            from scm.vehicles.sensor import all_sensors

            car_file = Path("brake.toml")
            nigel = Path("scm/vehicles/types/nigel.toml").read_text()
            rate = 'rate_hz = { value = 10, source = "test" }'
            car_file.write_text(f"{nigel}[brake_light]\\n{rate}\\n")
            sensor = all_sensors()["brake_light"]
            assert sensor.is_fitted(load_car(str(car_file)))
            assert not sensor.is_fitted(load_car("nigel"))
        """,
    ),
    "a car": Thing(
        files={"scm/vehicles/types/cart.toml": copy_of("scm/vehicles/types/nigel.toml")},
        check="""
            from scm.vehicles.car import load_car

            assert load_car("cart").path.name == "cart.toml"
        """,
    ),
    "a map": Thing(
        files={"maps/yard.toml": copy_of("maps/driving_school.toml")},
        check="""
            from scm.maps.load import load_map

            assert load_map("yard").junctions
        """,
    ),
    "a signal plan": Thing(
        files={
            "scm/traffic/signals/plans/gentle.py": copy_of("scm/traffic/signals/plans/brisk.py"),
        },
        check="""
            from scm.maps.load import load_map
            from scm.traffic.signals.part import TrafficPart

            TrafficPart(load_map("driving_school"), "gentle")
        """,
    ),
    "a signal policy": Thing(
        files={
            "scm/traffic/signals/policies/all_red.py": copy_of(
                "scm/traffic/signals/policies/flashing.py"
            ),
        },
        check="""
            from scm.traffic.signals.policy import load_policy, policy_names

            assert "all_red" in policy_names()
            assert load_policy("all_red").is_flash
        """,
    ),
    "a message": Thing(
        files={
            "scm/v2x/messages/weather.py": '''
                """The weather over the city."""

                from typing import ClassVar

                from scm.v2x.message import Message


                class Weather(Message, kw_only=True, frozen=True):
                    """Air temperature."""

                    KEY: ClassVar[str] = "weather"

                    t_ns: int
                    air_c: float


                MESSAGE = Weather
            ''',
        },
        edits={
            "scm/v2x/rights.py": [
                ('publishes=("part/{me}/status"', 'publishes=("weather", "part/{me}/status"'),
            ],
        },
        check="""
            from scm.recorder.mcap_file import MESSAGES
            from scm.registry import load
            from scm.v2x.rights import rights_of

            assert load(MESSAGES, "weather", "MESSAGE", type).KEY == "weather"
            assert "weather" in rights_of("vehicle", "n1").publishes
        """,
    ),
    "a REST noun that only reads": Thing(
        files={
            "scm/api/routes/greetings.py": '''
                """Greetings of the city."""

                from fastapi import APIRouter, Response

                from scm.api.city import json_response
                from scm.api.roles import VIEWER
                from scm.api.schemas import answer
                from scm.records.greetings import Greetings


                def router() -> APIRouter:
                    """Return the routes."""
                    routes = APIRouter(tags=["greetings"], dependencies=[VIEWER])

                    @routes.get("/greetings", summary="Greet", responses=answer(Greetings))
                    async def greetings() -> Response:
                        return json_response(Greetings(text="Hello"))

                    return routes
            ''',
            "scm/records/greetings.py": '''
                """Greetings of the city."""

                import msgspec

                from scm.records.fields import Text


                class Greetings(msgspec.Struct, kw_only=True, frozen=True):
                    """What the city says to who comes in."""

                    text: Text
            ''',
        },
        check="""
            from scm.api.app import create_app
            from scm.api.view import CityView
            from scm.maps.load import load_map

            app = create_app(CityView(), lambda *_: None, load_map("driving_school"))
            assert "/api/v1/greetings" in app.openapi()["paths"]
        """,
    ),
    "a page of the dashboard": Thing(
        files={
            f"{STATIC}/js/pages/weather/page.js": '''
                import { html } from "scm/shared/html.js";

                export const Page = () => html`<p>Sunny</p>`;
            ''',
        },
        edits={
            f"{STATIC}/js/pages/index.js": [
                ("\n];", '\n  { name: "weather", title: "Weather", '
                 'load: () => import("scm/pages/weather/page.js") },\n];'),
            ],
        },
        check="""
            from scm.api.based import PAGES
            from scm.api.dashboard import page_text

            assert PAGES["weather"].title == "Weather"
            text = page_text("weather")
            assert '<a href="/weather" aria-current="page">Weather</a>' in text
            assert "/static/js/pages/weather/page.js" in text
        """,
    ),
    "a body of an agent": Thing(
        files={"vehicle_agent/bodies/trolley.py": copy_of("vehicle_agent/bodies/simulated.py")},
        check="""
            from vehicle_agent.agent import AgentPart

            AgentPart("n1", body="trolley")
        """,
    ),
    "a panel of a mismatch report": Thing(
        edits={
            "scm/mismatch/report/panels.py": [
                ("return [*panels, ", 'return [Panel("effect", "Sky", "It rained", []), *panels, '),
            ],
        },
        check="""
            from tests.unit.mismatch import made_up_findings

            from scm.mismatch.report.panels import panels_of

            assert panels_of(*made_up_findings.pair()[:2])[0].title == "It rained"
        """,
    ),
    "an attack on the radio": Thing(
        files={
            "scm/traffic/misbehaviour/attacks/frozen_clock.py": copy_of(
                "scm/traffic/misbehaviour/attacks/zero_speed.py"
            ),
        },
        check="""
            from scm.traffic.misbehaviour.attack import load_attack

            assert load_attack("frozen_clock").about
        """,
    ),
    "a command": Thing(
        files={"scm/commands/trim.py": copy_of("scm/commands/cut.py")},
        check="""
            from scm.__main__ import parse

            assert parse(["trim", "today.mcap", "--out", "lap.mcap"]).command == "trim"
        """,
    ),
}  # fmt: skip


def table() -> dict[str, list[re.Pattern[str]]]:
    """Return what the page's table tells to touch, by what is added; `<name>` stands for a name."""
    rows = re.findall(r"^\| (an? .*?) \| (.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {
        thing: [
            re.compile(re.sub(r"<\w+>", r"\\w+", re.escape(path).replace("\\<", "<")))
            for path in re.findall(r"`([\w./<>-]+\.\w+)`", files.partition("; then")[0])
        ]
        for thing, files in rows
    }


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What the program with all things says of each; empty: it knows it."""
    copy = tmp_path_factory.mktemp("project")
    for package in ("scm", "vehicle_agent", "maps"):
        shutil.copytree(ROOT / package, copy / package)
    for thing in THINGS.values():
        for path, text in thing.files.items():
            (copy / path).parent.mkdir(exist_ok=True)
            (copy / path).write_text(cleandoc(text) + "\n", encoding="utf-8")
        for path, edits in thing.edits.items():
            place = copy / path
            text = place.read_text(encoding="utf-8")
            for old, new in edits:
                assert text.count(old) == 1, f"{path}: {old}"
                text = text.replace(old, new)
            place.write_text(text, encoding="utf-8")
    checks = {name: cleandoc(thing.check) for name, thing in THINGS.items()}
    done = subprocess.run(
        [sys.executable, "-c", RUN], cwd=copy, env=os.environ | {"PYTHONPATH": f"{copy}:{ROOT}"},
        input=json.dumps(checks), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found: dict[str, str] = json.loads(done.stdout)
    return found


RUN = """
import json, sys, traceback
found = {}
for name, check in json.load(sys.stdin).items():
    try:
        exec(check, {})
    except BaseException:
        found[name] = traceback.format_exc()
json.dump(found, sys.stdout)
"""


@pytest.mark.parametrize("name", THINGS)
def test_the_program_knows_it_by_the_files_that_the_page_names(
    name: str, known: dict[str, str]
) -> None:
    assert name not in known, known[name]
    touched = [*THINGS[name].files, *THINGS[name].edits]
    named = table()[name]
    assert all(any(pattern.fullmatch(path) for pattern in named) for path in touched)


@pytest.mark.parametrize("name", table())
def test_everything_that_the_page_names_is_added_here(name: str) -> None:
    assert name in THINGS
