"""Two cities with real routers and real gateways between them, in one process."""

import threading
from contextlib import ExitStack
from datetime import UTC, datetime

import zenoh

from scm.clock import WallClock, seconds
from scm.v2x import zenoh_config
from scm.v2x.access import guard_of, own_stations
from scm.v2x.crossing import INNER, common_name
from scm.v2x.fleet_file import (
    Fleet,
    add,
    add_neighbour,
    authority_certificate,
    issue_gateway_files,
    load_fleet,
)
from scm.v2x.gateway import Border, Gateway, settings_of
from scm.v2x.router import Router, free_endpoint

CLOCK = WallClock()
NEVER = threading.Event()
PATIENCE_S = 30.0
NOW = datetime.now(UTC)
OTHER = {"a": "b", "b": "a"}


def until(condition, also=lambda: None, patience_s=PATIENCE_S):
    """Wait until a condition holds, and do something each time before."""
    began_ns = CLOCK.now_ns()
    while not condition():
        also()
        assert seconds(CLOCK.now_ns() - began_ns) < patience_s
        NEVER.wait(0.02)


class TwoCities:
    """City a waits for city b; each has its own router, and its own fleet with `mtls`."""

    def __init__(self, folder, auth, shows, listen=None):
        self.folder, self.auth, self.shows = folder, auth, shows
        self.stack = ExitStack()
        self.endpoint = listen or self._free()
        self.join_at = {"a": self.endpoint, "b": self.endpoint}
        self.fleets, self.guards, self.routers, self.gateways = {}, {}, {}, {}
        for city in "ab":
            (folder / city).mkdir()
            if auth == "mtls":
                self.fleets[city] = Fleet(folder / city / "fleet.toml", "mtls")
                add(self.fleets[city], "selftest", "part", NOW)
                add(self.fleets[city], "anna", "operator", NOW)
        for city in "ab":
            if auth == "mtls":
                theirs = authority_certificate(self.fleets[OTHER[city]], NOW)
                add_neighbour(self.fleets[city], OTHER[city], theirs, NOW)
                issue_gateway_files(self.fleets[city], common_name(city), NOW)
            self.guards[city] = self._guard(city)

    def _free(self):
        endpoint = free_endpoint()
        return endpoint.replace("tcp/", "tls/") if self.auth == "mtls" else endpoint

    def _guard(self, city):
        fleet = self.fleets[city].path if city in self.fleets else None
        stations = own_stations(("eye",), (), (OTHER[city],))
        guard = guard_of(fleet, city, self._free(), stations, NOW, (OTHER[city],))
        if fleet is not None:
            self.fleets[city] = load_fleet(fleet)
        return guard

    def border(self, city):
        return Border(
            city=city,
            neighbour=OTHER[city],
            inner=f"{INNER}/{self.folder}/{city}.sock",
            endpoint=self.join_at[city],
            listens=city == "a",
            shows=self.shows[city],
            secrets=self.fleets[city].folder if city in self.fleets else None,
        )

    def start(self, city, *, gateway=True):
        guard = self.guards[city]
        border = self.border(city)
        self.routers[city] = self.stack.enter_context(
            Router(guard.listen, guard.settings, border.inner)
        )
        if gateway:
            self.gateways[city] = self.stack.enter_context(Gateway(border))

    def credentials(self, city, name):
        return self.guards[city].credentials(name) or (
            None if self.auth == "open" else _read(self.fleets[city], name)
        )

    def raw(self, city, name):
        """Return a bare session of a station: it is bound to none of our habits."""
        who = self.credentials(city, name)
        settings = None if who is None else who.client_settings()
        text = zenoh_config.client(self.guards[city].connect, PATIENCE_S, settings)
        return self.stack.enter_context(zenoh.open(zenoh.Config.from_json5(text)))

    def rogue_gateway(self, station=""):
        """Return a router of city b that linked itself to a, without any rules of its own.

        With `station` it has the certificate of that station instead of the gateway's.
        """
        transport = {"transport": settings_of(self.border("b"))["transport"]}
        if station:
            own = self.credentials("b", station).client_settings()["link"]["tls"]
            tls = transport["transport"]["link"]["tls"]
            for name in ("connect_certificate", "connect_private_key"):
                del tls[name]
                tls[f"{name}_base64"] = own[f"{name}_base64"]
        text = zenoh_config.router([], transport, [self.endpoint])
        return self.stack.enter_context(zenoh.open(zenoh.Config.from_json5(text)))


def _read(fleet, name):
    from scm.v2x.credentials import read_credentials

    return read_credentials(fleet.credentials(name), name)
