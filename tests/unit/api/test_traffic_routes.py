from scm.records.traffic import ApproachCount
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.traffic_counts import TrafficCounts
from scm.v2x.messages.violation import Violation

API = "/api/v1"


def violation(number, vehicle):
    return Violation(
        vehicle=vehicle, number=number, kind="speed", t_ns=number, x_m=1.0, y_m=2.0,
        text="too fast", certainty=0.99, sources=("eye",),
    )  # fmt: skip


def test_counts_are_the_newest_that_the_observer_told(client, hear):
    response = client("GET", f"{API}/traffic")
    assert response.status_code == 404
    assert "observer" in response.json()["detail"]
    for passed in (1, 2):
        approach = ApproachCount(junction="x", lane="a", passed=passed, flow_hz=0.1, level="B")
        hear(1.0, TrafficCounts(t_ns=passed, window_s=10.0, approaches=(approach,)))
    body = client("GET", f"{API}/traffic").json()
    assert (body["approaches"][0]["passed"], body["approaches"][0]["level"]) == (2, "B")


def test_counts_of_a_window_in_which_signals_flashed_are_void(client, hear):
    seconds = 1_000_000_000
    for at_s in range(93, 111):
        mode = "flash" if 104 <= at_s < 108 else "plan"
        spat = Spat(junction="x", t_ns=at_s * seconds, seq=1, mode=mode, plan="calm", groups=())
        hear(float(at_s), spat)
    for end_s, void in ((103, []), (110, ["the signals of x flash for 4.0 of 10.0 s"])):
        hear(110.0, TrafficCounts(t_ns=end_s * seconds, window_s=10.0, approaches=()))
        assert client("GET", f"{API}/traffic").json()["void"] == void


def test_violations_are_listed_newest_first_and_by_car(client, hear):
    hear(1.0, violation(1, "n1"), violation(2, "n2"), violation(3, "n1"))
    path = f"{API}/traffic/violations"
    everyone = client("GET", path).json()["violations"]
    assert [one["number"] for one in everyone] == [3, 2, 1]
    assert [one["number"] for one in client("GET", f"{path}?limit=1").json()["violations"]] == [3]
    one_car = client("GET", f"{path}?vehicle=n2").json()["violations"]
    assert [one["number"] for one in one_car] == [2]
