"""In a city: a change is decided by the car that was sent, and by no other."""

import numpy as np
from msgspec.structs import replace

from scm.clock import NS_PER_S, nanoseconds
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.traffic.signals.part import TrafficPart
from scm.twin import car as twin_car
from scm.twin.evidence import Evidence
from scm.twin.part import TwinPart
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.twin_status import TwinStatus
from scm.world.part import WorldPart
from tests.unit.twin.test_causes import NUMBERS, ROLLING, change

MAP, BEND, RADIUS_M = load_map("driving_school"), (2.6, 0.7), 0.35
BEGIN_S, BEFORE_S, SINCE_S, LASTS_S = 2000.0, -900.0, -65.0, 63.0
CARS = (("n1", "nigel"), ("n2", "nigel"))
SIZE = 2.5  # standard deviations of a window


class Shown:
    """What a car shows without driving it again, where a camera sees it: in the eastern bend.

    Both drove there before. n1 changed 65 s before the city began, and drove there since.
    """

    is_learning, driven_s, is_known = False, 0.0, False

    def __init__(self, predictor, threshold):
        self._rng = np.random.default_rng(7)
        empty = np.empty((0, len(NUMBERS)))
        none = np.empty(0)
        self.evidence = Evidence(
            NUMBERS,
            none,
            np.empty((0, 2)),
            none.astype(str),
            empty,
            empty,
            empty,
            np.ones(len(NUMBERS)),
        )
        self._add(np.arange(BEFORE_S, SINCE_S, 2.0))

    def look(self, recording, first_s, last_s, camera):
        """Note where the car was."""
        has_changed = recording.name == "n1"
        if has_changed and not self.is_known:
            self._add(np.arange(SINCE_S, 0.0, 0.5), has_changed=True)
        self.is_known = True
        times_s = np.arange(first_s, last_s, 0.5)
        x, y = (recording.channels[f"pose.{axis}"] for axis in "xy")
        places = np.column_stack([np.interp(times_s, one.t, one.values) for one in (x, y)])
        is_seen = np.hypot(*(places - BEND).T) < RADIUS_M
        self._add(times_s[is_seen], places[is_seen], has_changed=has_changed)

    def _add(self, times_s, places=None, *, has_changed=False):
        one, scores = self.evidence, self._rng.standard_normal((len(times_s), len(NUMBERS)))
        if places is None:
            places = BEND + self._rng.uniform(-0.2, 0.2, (len(times_s), 2))
        scores[:, ROLLING] += SIZE * has_changed
        one.t_s, one.places = np.append(one.t_s, times_s), np.vstack((one.places, places))
        one.cameras = np.append(one.cameras, np.full(len(times_s), ""))
        one.scores = np.vstack((one.scores, scores))
        one.whole = one.scores
        one.information = np.vstack((one.information, np.ones_like(scores)))


def undecided():
    """Return n1's change, noticed before the city began."""
    since_ns, known = nanoseconds(BEGIN_S + SINCE_S), change()
    return replace(
        known, since_ns=since_ns, since_low_ns=since_ns - NS_PER_S, search="unexplained",
        since_high_ns=since_ns + NS_PER_S, noticed_ns=since_ns + 10 * NS_PER_S,
    )  # fmt: skip


def test_undecided_change_is_decided_by_the_car_that_is_sent(monkeypatch):
    """n1 circulates; n2 stands on the western loop, and would stand there for ever."""
    monkeypatch.setattr(twin_car, "CarWatch", Shown)
    monkeypatch.setattr(twin_car, "LOCATE_NS", 5 * NS_PER_S)
    kinds = (CityEvent, TwinStatus, Trip)
    parts = [WorldPart(MAP, 0, CARS), TrafficPart(MAP)]
    with Lockstep(parts, start_ns=nanoseconds(BEGIN_S)) as city:
        city.call(RouteRequest(vehicle="n2", via=("west_loop",), request_id="there"))
        found = undecided()
        city.add(TwinPart(changes={f"n1/{found.noticed_ns}": found}, send="idle"))
        boxes = [city.subscribe(Subscription(kind)) for kind in kinds]
        city.run_for(LASTS_S)
        events, statuses, trips = ([item.message for item in box.drain()] for box in boxes)
    assert [one.text for one in events if one.source == "twin"] == [
        "n2 is sent through (2.6, 0.7), to decide whose n1's change is",
        "n1 itself changed: no other car that drove since did",
    ]
    changes = [one.changes[0] for one in statuses if one.vehicle == "n1"]
    states = [one.drive.state for one in changes if one.drive is not None]
    assert list(dict.fromkeys(states)) == ["open", "waiting", "under_way", "driven"]
    assert (changes[-1].cause, changes[-1].decide_by) == ("car", "")
    of_n2 = [one for one in trips if one.vehicle == "n2"]
    there, sent, back = dict.fromkeys(one.trip_id for one in of_n2)
    assert (there, back) == ("there", f"{sent}-back")  # sent once
    assert (of_n2[-1].route[-1], of_n2[-1].then) == ("west_loop", "stop")
