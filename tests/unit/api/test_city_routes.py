"""The city itself, its stations one by one, and whether the server can work."""

import shutil
from collections import namedtuple

import pytest

from scm.api.app import create_app
from scm.api.city import Link
from scm.api.folders import folders_in
from scm.clock import NS_PER_S, StepClock
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence


@pytest.fixture
def heard(hear, snapshot):
    here = Presence(role="part", station="world", session="s", alive=True)
    hear(2.0, here, PartStatus(station="world", t_ns=1, detail="1 car"), snapshot(n1=(0, 0, 0)))


class TestCities:
    def test_this_city_is_the_only_one(self, client, heard):
        (city,) = client("GET", "/api/v1/cities").json()["cities"]
        assert (city["name"], city["title"]) == ("driving_school", "Driving School")
        assert (city["vehicles"], city["tick"], city["junctions"]) == (1, 1, 1)
        assert [part["detail"] for part in city["parts"]] == ["1 car"]
        assert client("GET", "/api/v1/cities/driving_school").json() == city

    def test_before_the_world_is_heard_its_time_is_unknown(self, client):
        city = client("GET", "/api/v1/cities/driving_school").json()
        assert (city["t_ns"], city["snapshot_age_s"], city["vehicles"]) == (None, None, 0)

    def test_it_is_called_as_on_the_bus(self, view, fake_city, city_map, client_of):
        link = Link(city="lab")
        ask = client_of(create_app(view, fake_city.ask, city_map, link=link))
        assert ask("GET", "/api/v1/cities/lab").json()["map"] == "driving_school"
        assert ask("GET", "/api/v1/cities/driving_school").status_code == 404


class TestStations:
    def test_one_station_has_its_rows_and_its_events(self, client, heard, hear, event):
        hear(2.5, event("first"), event("second"))
        (row,) = client("GET", "/api/v1/stations/world").json()["stations"]
        assert (row["name"], row["alive"]) == ("world", True)
        told = client("GET", "/api/v1/stations/world/events").json()["events"]
        assert [one["text"] for one in told] == ["second", "first"]

    @pytest.mark.parametrize("path", ["/nobody", "/nobody/events"])
    def test_a_station_that_never_was_is_not_found(self, client, path):
        assert client("GET", f"/api/v1/stations{path}").status_code == 404


class TestReady:
    @pytest.fixture
    def ready(self, view, fake_city, city_map, client_of, tmp_path):
        def ask(**link):
            folders = folders_in(tmp_path / "runs")
            app = create_app(view, fake_city.ask, city_map, folders=folders, link=Link(**link))
            return client_of(app)("GET", "/readyz")

        return ask

    def test_router_world_and_disk_are_looked_at(self, ready, heard):
        answer = ready()
        assert answer.status_code == 200
        checks = {check["name"]: check["good"] for check in answer.json()["checks"]}
        assert checks == {"router": True, "world": True, "parts": True, "disk": True}

    def test_a_part_that_is_gone_for_good_or_never_came_is_named(self, ready, heard, hear):
        for alive in (True, False):
            hear(2.0, Presence(role="part", station="record", session="r", alive=alive))
        hear(2.0, Presence(role="v", station="observer", session="o", alive=True))
        answer = ready(parts=("world", "record", "observer"))
        assert (answer.status_code, answer.json()["code"]) == (503, "not_ready")
        assert answer.json()["detail"].startswith("parts: record, observer not there")
        hear(2.0, Presence(role="part", station="record", session="r2", alive=True))
        assert ready(parts=("world", "record")).status_code == 200

    def test_without_the_router_it_is_not_ready(self, ready, heard):
        answer = ready(is_connected=lambda: False)
        assert answer.status_code == 503
        assert answer.json()["detail"].startswith("router: not connected")

    def test_a_view_that_hangs_shows_by_the_clock(self, ready, heard):
        late = ready(clock=StepClock(5 * NS_PER_S))
        assert (
            late.json()["detail"]
            == "world: the newest snapshot is 3.0 s old, expected at most 2.0 s"
        )

    @pytest.fixture
    def full(self, monkeypatch):
        usage = namedtuple("usage", "total used free")
        monkeypatch.setattr(shutil, "disk_usage", lambda _folder: usage(10, 10, 2**20))

    def test_a_full_disk_is_told_by_the_kind_of_shelf_and_never_by_its_folder(
        self, ready, heard, full, tmp_path
    ):
        answer = ready()
        expected = "disk: where recordings are stored 1 MiB are free, expected 200 or more"
        assert answer.json()["detail"] == expected
        assert str(tmp_path) not in answer.text

    def test_the_folder_of_a_full_shelf_stands_in_the_log_once(
        self, view, fake_city, city_map, client_of, heard, full, tmp_path, caplog
    ):
        folders = folders_in(tmp_path / "runs")
        ask = client_of(create_app(view, fake_city.ask, city_map, folders=folders))
        assert [ask("GET", "/readyz").status_code for _ in range(3)] == [503] * 3
        told = [line for line in caplog.messages if line.startswith("disk_short")]
        assert told == [f"disk_short shelf=recordings at={tmp_path} free_mib=1"]
