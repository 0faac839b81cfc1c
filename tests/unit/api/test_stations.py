from scm.api.stations import StationTable
from scm.clock import NS_PER_S
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.presence import Presence


def presence(name, alive=True, role="part", session="s1"):
    return Presence(role=role, station=name, session=session, alive=alive)


def names(table, now_s):
    return [(row.name, row.alive) for row in table.rows(now_s * NS_PER_S)]


def test_a_station_that_came_is_listed_since_then():
    table = StationTable()
    table.presence(presence("world"), 5)
    table.presence(presence("world"), 9)
    (row,) = table.rows(10)
    assert (row.name, row.alive, row.since_ns) == ("world", True, 5)


def test_a_station_that_died_stays_listed_as_lost_for_a_minute():
    table = StationTable()
    table.presence(presence("n7", role="v"), 0)
    table.presence(presence("n7", role="v", alive=False), 10 * NS_PER_S)
    table.forget(69 * NS_PER_S)
    assert names(table, 69) == [("n7", False)]
    table.forget(71 * NS_PER_S)
    assert names(table, 71) == []


def test_the_loss_of_a_station_never_seen_is_not_listed():
    table = StationTable()
    table.presence(presence("ghost", alive=False), 0)
    assert names(table, 0) == []


def test_two_runs_of_one_name_are_two_rows():
    table = StationTable()
    table.presence(presence("n7", session="old"), 0)
    table.presence(presence("n7", session="old", alive=False), 1)
    table.presence(presence("n7", session="new"), 2)
    assert names(table, 1) == [("n7", False), ("n7", True)]


def test_parts_come_before_vehicles_before_clients():
    table = StationTable()
    for name, role in (("a", "client"), ("b", "v"), ("d", "part"), ("c", "part")):
        table.presence(presence(name, role=role), 0)
    assert [row.name for row in table.rows(0)] == ["c", "d", "b", "a"]


def test_a_row_carries_the_last_status_and_its_age():
    table = StationTable()
    table.presence(presence("eye"), 0)
    status = PartStatus(station="eye", t_ns=0, detail="7 tags", step_ms=12.345, late_steps=3)
    table.status(status, NS_PER_S)
    (row,) = table.rows(3 * NS_PER_S)
    assert (row.age_s, row.detail, row.step_ms, row.late_steps) == (2.0, "7 tags", 12.35, 3)


def test_a_station_that_never_told_has_no_age():
    table = StationTable()
    table.presence(presence("eye"), 0)
    assert table.rows(NS_PER_S)[0].age_s is None


def told_each_second(table, seconds, *, late_a_second, steps_a_second=20, from_s=0):
    for n in range(seconds):
        t_ns = (from_s + n) * NS_PER_S
        counts = {"steps": n * steps_a_second, "late_steps": n * late_a_second, "dropped": n}
        table.status(PartStatus(station="eye", t_ns=t_ns, **counts), t_ns)


def test_lateness_is_a_share_of_the_last_minute_not_a_count_since_the_start():
    table = StationTable()
    table.presence(presence("eye"), 0)
    told_each_second(table, 600, late_a_second=20)
    (row,) = table.rows(599 * NS_PER_S)
    assert (row.late_steps, row.late_share, row.dropped_lately) == (599 * 20, 0.5, 60)
    for n in range(61):  # it recovers: a minute later nothing of it is left
        t_ns = (600 + n) * NS_PER_S
        counts = {"steps": 12_000 + 20 * n, "late_steps": 599 * 20, "dropped": 599}
        table.status(PartStatus(station="eye", t_ns=t_ns, **counts), t_ns)
    (row,) = table.rows(660 * NS_PER_S)
    assert (row.late_steps, row.late_share, row.dropped_lately) == (599 * 20, 0.0, 0)


def test_a_part_that_was_started_again_is_not_judged_by_its_counts_before():
    table = StationTable()
    table.presence(presence("eye"), 0)
    told_each_second(table, 10, late_a_second=5)
    told_each_second(table, 3, late_a_second=0, from_s=10)
    (row,) = table.rows(12 * NS_PER_S)
    assert (row.late_share, row.dropped_lately) == (0.0, 2)
