"""Plays the story of docs/twin.md, prints what was reported, and makes its pictures.

Run with `python -m docs.make.twin_story [FOLDER]` in a clone: twenty minutes of a city in lockstep,
in which somebody knocks n3's front wheels, and later something is spilled in a bend of the road.
"""

import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from docs.make.drawing import plt
from scm.clock import NS_PER_S, seconds
from scm.errors import RecordingError
from scm.maps.load import load_map
from scm.recorder.driven import CarMessages, recording_of
from scm.recording.span import part_of
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import BasePart, Part, Service, Subscription
from scm.traffic.signals.part import TrafficPart
from scm.twin.investigation import AtOnce, compare
from scm.twin.part import TwinPart
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.car import load_car
from scm.world.part import WorldPart
from tests.e2e.pages.conftest import ARGUMENTS, CHROMIUM
from tests.e2e.pages.town import town
from tests.e2e.pages.visiting import SIZES
from vehicle_agent.agent import AgentPart
from vehicle_agent.bodies.simulated import Change, SimulatedBody
from vehicle_agent.body import BodyKind

PICTURES = Path(__file__).parents[1] / "pictures"
MAP, CAR, KNOCKED = "driving_school", "nigel", "n3"
BEGIN_NS = 1_800_000_000 * NS_PER_S
KNOCKED_S, SPILLED_S, LASTS_S, STEP_S, MINUTE_S = 420.0, 840.0, 1200.0, 10.0, 60.0
TRIM_RAD = -0.05
SPILLED = {"x_m": 2.6, "y_m": 0.7, "radius_m": 0.3, "grip": 1.0, "rolling": 0.05}
SHOWN_MS = 2000.0
MARGIN = 1.25  # of the picture, for words above the curves


def changed(folder: Path, name: str, term: str, section: str, numbers: dict[str, float]) -> str:
    """Write a car file like the given one with one more effect; return its path."""
    text = load_car(CAR).path.read_text("utf-8").replace("terms = [", f'terms = ["{term}", ', 1)
    head, found, rest = text.partition(f"[{section}]\n")
    lines = "".join(f"{key} = {{ value = {value} }}\n" for key, value in numbers.items())
    path = folder / f"{name}.toml"
    path.write_text(f"{head}[{section}]\n{lines}{rest if found else ''}", "utf-8")
    return str(path)


def agent(name: str, file: str, after_s: float) -> AgentPart:
    """Return a car that becomes another one, unreported."""
    change = Change(file, after_s)
    body = BodyKind("remote", lambda car, seed, _: SimulatedBody(car, seed, change))
    return AgentPart(name, body=body)


def play(folder: Path) -> tuple[list[CityEvent], dict[str, TwinStatus], CarMessages]:
    """Let the city run; return events, the newest status of each car, and what n3 reported."""
    trim = changed(folder, "trimmed", "steer_trim", "steering", {"trim_rad": TRIM_RAD})
    spilled = changed(folder, "spilled", "surface_patch", "surface_patch", SPILLED)
    city_map, events, reported = load_map(MAP), list[CityEvent](), CarMessages()
    statuses = dict[str, TwinStatus]()
    cars = [agent(KNOCKED, trim, KNOCKED_S), *(agent(n, spilled, SPILLED_S) for n in ("n1", "n2"))]
    parts: list[Part] = [TrafficPart(city_map), WorldPart(city_map), *cars]
    with Lockstep(parts, start_ns=BEGIN_NS) as city:
        city.add(TwinPart(data=folder, executor=AtOnce()))
        kinds = (CityEvent, TwinStatus, VehicleState, VehicleSensors)
        boxes = [city.subscribe(Subscription(kind)) for kind in kinds]
        for _ in range(round(LASTS_S / STEP_S)):
            city.run_for(STEP_S)
            for message in (item.message for box in boxes for item in box.drain()):
                if isinstance(message, CityEvent):
                    events += [message] if message.source == "twin" else []
                elif isinstance(message, TwinStatus):
                    statuses[message.vehicle] = message
                elif getattr(message, "vehicle", "") == KNOCKED:
                    reported.add(message)
    return events, statuses, reported


def draw(events: Sequence[CityEvent], status: TwinStatus, reported: CarMessages, out: Path) -> None:
    """Draw how far both versions of n3's file stray in 3 s, minute by minute."""
    recording = recording_of(reported, out, KNOCKED, BEGIN_NS)
    file = status.versions[status.version].file
    errors = defaultdict[str, list[tuple[float, float]]](list)
    for k in range(int(LASTS_S / MINUTE_S)):
        try:
            found = compare(part_of(recording, k * MINUTE_S, (k + 1) * MINUTE_S), CAR, file)
        except RecordingError:
            continue
        (position,) = [one for one in found.errors if one.name == "position_m"]
        errors["nigel, the file it came with"].append((k + 0.5, 1e3 * position.before))
        errors[f"version {status.version}, found in the city"].append((k + 0.5, 1e3 * position.now))
    figure, axes = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
    for name, rows in errors.items():
        axes.plot(*zip(*rows, strict=True), "o-", markersize=4, label=name)
    top = MARGIN * axes.get_ylim()[1]
    moments = [(KNOCKED_S / MINUTE_S, "knocked", "0.4")]
    words = {"car_changed": "noticed", "change_explained": "named", "version": "version 1"}
    for event in events:
        if event.vehicle == KNOCKED and event.name in words:
            at = seconds(event.t_ns - BEGIN_NS) / MINUTE_S
            moments.append((at, words[event.name], "tab:red"))
    for k, (at, word, colour) in enumerate(moments):
        axes.axvline(at, color=colour, linewidth=1.0)
        side = "right" if k == 0 else "left"
        height = (0.99 - 0.06 * (k % 2)) * top  # neighbours' words would touch
        axes.text(at, height, f" {word} ", va="top", ha=side, color=colour)
    axes.set(xlabel="minutes", ylabel="position error after 3 s [mm]", ylim=(0.0, top))
    axes.set_xticks(np.arange(0.0, LASTS_S / MINUTE_S + 1.0, 2.0))
    axes.set_title("How well the city predicts n3", loc="left")
    axes.legend(loc="center right", frameon=False)
    figure.savefig(out, dpi=110)
    plt.close(figure)


class Reports(BasePart):
    """Sends the newest status of each car again."""

    name, role, period_ns = "twin", "part", NS_PER_S
    subscriptions: Sequence[Subscription] = ()
    services: Sequence[Service] = ()

    def __init__(self, statuses: Sequence[TwinStatus]) -> None:
        self._statuses = statuses

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Report."""
        del now_ns, inbox
        return [*self._statuses]


def photograph(statuses: dict[str, TwinStatus], folder: Path) -> None:
    """Take pictures of the pages that show this."""
    pages = {"twin_story": f"/twins/{KNOCKED}", "twin_story_map": "/map"}
    width, height = SIZES["wide"]
    with (
        tempfile.TemporaryDirectory() as scratch,
        town(MAP, Path(scratch), cars=3) as city,
        city.joined(Reports(tuple(statuses.values()))),
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": width, "height": height})
        for name, path in pages.items():
            page.goto(city.url + path)
            page.wait_for_timeout(SHOWN_MS)
            page.screenshot(path=folder / "dashboard" / f"{name}.png")
        browser.close()


def main() -> None:
    """Play it, print it, draw it."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURES
    with tempfile.TemporaryDirectory() as scratch:
        events, statuses, reported = play(Path(scratch))
        for event in events:
            at_s = round(seconds(event.t_ns - BEGIN_NS))
            sys.stdout.write(f"{at_s // 60:02}:{at_s % 60:02}  {event.text}\n")
        draw(events, statuses[KNOCKED], reported, folder / "twin_story.png")
        photograph(statuses, folder)


if __name__ == "__main__":
    main()
