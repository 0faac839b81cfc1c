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
