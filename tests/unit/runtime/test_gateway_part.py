"""What a gateway reports of its neighbour, from statuses and links that the test makes up."""

import pytest

from scm.clock import NS_PER_S
from scm.runtime.gateway_part import LOST_NS, REOPEN_NS, GatewayPart
from scm.v2x.exchange import Incoming
from scm.v2x.gateway import Border
from scm.v2x.link_log import refusal_in
from scm.v2x.mailbox import Mailbox
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.neighbour_status import NeighbourStatus

BORDER = Border(
    city="a", neighbour="b", inner="", endpoint="tls/h:1", listens=True, shows=("states",)
)


class Watched:
    """A part whose links and whose neighbour the test decides."""

    def __init__(self):
        self.links, self.refusal, self.reopened = [], "", 0
        self.received = Mailbox(10)
        self.part = GatewayPart(
            BORDER, self.received, lambda: self.links, lambda: self.refusal, self._reopen
        )
        self.now_ns = 100 * NS_PER_S
        self.status, self.events = None, []

    def _reopen(self):
        self.reopened += 1

    def run(self, span_ns, *, receives=False):
        end_ns = self.now_ns + span_ns
        while self.now_ns < end_ns:
            if receives:
                message = NeighbourStatus(
                    neighbour="a", t_ns=1, state="waiting", since_ns=1, shows=("cams",)
                )
                self.received.put(Incoming(message, self.now_ns))
            for item in self.part.step(self.now_ns, []):
                if isinstance(item, NeighbourStatus):
                    self.status = item
                if isinstance(item, CityEvent):
                    self.events.append(item.name)
            self.now_ns += self.part.period_ns


@pytest.fixture
def watched():
    return Watched()


def test_neighbour_is_joined_while_its_status_arrives_and_lost_after_that(watched):
    watched.links = ["gateway@b"]
    watched.run(2 * NS_PER_S, receives=True)
    assert (watched.status.state, watched.status.sees) == ("joined", ("cams",))
    lost_from_ns = watched.now_ns
    watched.links = []
    watched.run(2 * LOST_NS)
    assert (watched.status.state, watched.status.sees) == ("lost", ())
    assert abs(watched.status.since_ns - lost_from_ns - LOST_NS) <= 2 * watched.part.period_ns
    assert watched.events == ["neighbour_joined", "neighbour_lost"]


def test_neighbour_that_never_came_is_waited_for_and_reported_once(watched):
    watched.run(20 * NS_PER_S)
    assert watched.status.state == "waiting"
    assert "waits at tls/h:1" in watched.status.reason
    assert watched.events == ["neighbour_waiting"]


def test_refused_certificate_is_the_reason(watched):
    watched.refusal = "refused: its certificate is not from the authority known for b"
    watched.run(NS_PER_S)
    assert watched.status.reason == watched.refusal


def test_link_with_the_certificate_of_a_station_is_refused_by_its_name(watched):
    watched.links = ["n7.1"]
    watched.run(NS_PER_S)
    assert "'n7.1', expected 'gateway@b'" in watched.status.reason


def test_link_over_which_nothing_comes_is_made_anew(watched):
    watched.links = ["gateway@b"]
    watched.run(REOPEN_NS + NS_PER_S)
    assert watched.reopened == 1
    watched.run(REOPEN_NS + NS_PER_S, receives=True)
    assert watched.reopened == 1


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (
            "WARN zenoh_link_tls::unicast: invalid peer certificate: UnknownIssuer. Hint: x",
            "refused: its certificate is not from the authority known for b",
        ),
        (
            "WARN zenoh_link_tls::unicast: invalid peer certificate: BadSignature. Hint: x",
            "refused: its certificate is not from the authority known for b",
        ),
        (
            "DEBUG Unable to connect! received fatal alert: UnknownCA at /src/u.rs:226.. Retry",
            "b refuses this city: it knows another authority for it",
        ),
        (
            'Unable: [h]: invalid peer certificate: certificate not valid for name "h"; x at /r',
            'refused: the certificate of b: certificate not valid for name "h"; x',
        ),
        ("DEBUG Unable to connect: Connection refused (os error 111) at /src/x.rs", ""),
    ],
)
def test_reason_of_a_refusal_is_read_from_the_log_of_zenoh(line, expected):
    assert refusal_in(line, "b") == expected
