from scm.api.event_log import EventLog
from scm.v2x.messages.city_event import CityEvent


def log_of(count, depth=2000):
    log = EventLog(depth)
    for number in range(1, count + 1):
        log.add(
            CityEvent(severity="info", source="world", t_ns=number, name="told", text=str(number))
        )
    return log


def test_after_gives_the_next_events_oldest_first():
    assert [event.seq for event in log_of(9).after(3, 4)] == [4, 5, 6, 7]


def test_after_the_newest_there_is_nothing():
    assert log_of(9).after(9, 4) == ()
    assert log_of(9).after(99, 4) == ()
    assert EventLog().after(0, 4) == ()


def test_a_full_log_forgets_the_oldest_but_never_a_number():
    log = log_of(10, depth=3)
    assert [event.seq for event in log.after(0, 9)] == [8, 9, 10]
    assert log.newest_seq == 10


def test_an_event_keeps_what_it_said():
    (event,) = log_of(1).after(0, 1)
    assert (event.severity, event.source, event.text, event.vehicle) == ("info", "world", "1", None)


def test_an_event_that_is_heard_again_is_noted_once_while_it_is_known():
    log, told = (
        EventLog(2),
        [
            CityEvent(severity="info", source="world", t_ns=number, name="told", text="same")
            for number in (1, 1, 2, 1, 3, 1)
        ],
    )
    for event in told:
        log.add(event)
    assert [(event.seq, event.t_ns) for event in log.newest_first()] == [(4, 1), (3, 3)]
