"""A written drive played with a car of a running city: it obeys, is recorded, and is given back."""

from pathlib import Path

from scm.__main__ import main
from scm.recording.read import read_recordings
from tests.e2e.city_process import city, wait_for


def test_a_car_of_a_running_city_plays_a_drive_and_goes_back_to_its_driver(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "t_s,throttle,steering\n0,0,0\n1,0.5,0\n3,0,0\n4,0,0\n", encoding="utf-8"
    )
    (tmp_path / "drive.yaml").write_text("drive: 1\ncommands: a.csv\n", encoding="utf-8")
    with city(tmp_path) as running:
        wait_for(lambda: running.get("/vehicles")["vehicles"], 20.0, "cars are on the map")
        arguments = ["play", str(tmp_path / "drive.yaml"), "--connect", running.endpoint]
        assert main([*arguments, "--vehicle", "n1", "--out", str(tmp_path / "out")]) == 0
        assert main([*arguments, "--vehicle", "n99", "--out", str(tmp_path / "no")]) == 2

        def given_back() -> bool:
            rows = {row["vehicle"]: row for row in running.get("/vehicles")["vehicles"]}
            return bool(rows["n1"]["owner"] == "world")

        wait_for(given_back, 5.0, "the city has its car again")
    (recording,) = read_recordings(tmp_path / "out")
    throttle, x, y = (recording.channel(n) for n in ("command.throttle", "pose.x", "pose.y"))
    began = x.t[0]
    assert throttle.values[throttle.t > began].max() == 0.5
    assert throttle.t[0] < began - 0.8, "a second before tells where its servo stood"
    assert 3.8 < throttle.t[-1] - began < 4.5
    assert len(x.t) > 60
    way = sum(abs(c.values[-1] - c.values[0]) for c in (x, y))
    assert 0.05 < way < 1.0
