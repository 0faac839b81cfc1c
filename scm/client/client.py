"""The client of a city, noun by noun.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Self

from scm.client.connection import Connection
from scm.client.nouns.audit import AuditNoun
from scm.client.nouns.boxes import BoxesNoun
from scm.client.nouns.cameras import CamerasNoun
from scm.client.nouns.cars import CarsNoun
from scm.client.nouns.cities import CitiesNoun
from scm.client.nouns.disturbances import DisturbancesNoun
from scm.client.nouns.events import EventsNoun
from scm.client.nouns.eye import EyeNoun
from scm.client.nouns.health import HealthNoun
from scm.client.nouns.keys import KeysNoun
from scm.client.nouns.leases import LeasesNoun
from scm.client.nouns.map import MapNoun
from scm.client.nouns.misbehaviour import MisbehaviourNoun
from scm.client.nouns.mismatch import MismatchNoun
from scm.client.nouns.neighbours import NeighboursNoun
from scm.client.nouns.ngsi import NgsiNoun
from scm.client.nouns.operations import OperationsNoun
from scm.client.nouns.recordings import RecordingsNoun
from scm.client.nouns.scans import ScansNoun
from scm.client.nouns.scenarios import ScenariosNoun
from scm.client.nouns.session import SessionNoun
from scm.client.nouns.signals import SignalsNoun
from scm.client.nouns.stations import StationsNoun
from scm.client.nouns.stop import StopNoun
from scm.client.nouns.stream import StreamNoun
from scm.client.nouns.studies import StudiesNoun
from scm.client.nouns.traffic import TrafficNoun
from scm.client.nouns.twins import TwinsNoun
from scm.client.nouns.vehicles import VehiclesNoun
from scm.client.teleop import Wheel, acquired
from scm.client.work import finished
from scm.records.operations import Operation


class Client:
    """A city over its web interface; close it, or use it in a `with`.

    Args:
        url: Where its dashboard is: `http://127.0.0.1:8000`.
        key: API key, where the city requires one; empty: of the file in `SCM_API_KEY_FILE`.
    """

    def __init__(self, url: str = "http://127.0.0.1:8000", key: str = "") -> None:
        self.connection = Connection(url, key)
        self.audit = AuditNoun(self.connection)
        self.boxes = BoxesNoun(self.connection)
        self.cameras = CamerasNoun(self.connection)
        self.cars = CarsNoun(self.connection)
        self.cities = CitiesNoun(self.connection)
        self.disturbances = DisturbancesNoun(self.connection)
        self.events = EventsNoun(self.connection)
        self.eye = EyeNoun(self.connection)
        self.health = HealthNoun(self.connection)
        self.keys = KeysNoun(self.connection)
        self.leases = LeasesNoun(self.connection)
        self.map = MapNoun(self.connection)
        self.misbehaviour = MisbehaviourNoun(self.connection)
        self.mismatch = MismatchNoun(self.connection)
        self.neighbours = NeighboursNoun(self.connection)
        self.ngsi = NgsiNoun(self.connection)
        self.operations = OperationsNoun(self.connection)
        self.recordings = RecordingsNoun(self.connection)
        self.scans = ScansNoun(self.connection)
        self.scenarios = ScenariosNoun(self.connection)
        self.session = SessionNoun(self.connection)
        self.signals = SignalsNoun(self.connection)
        self.stations = StationsNoun(self.connection)
        self.stop = StopNoun(self.connection)
        self.stream = StreamNoun(self.connection)
        self.studies = StudiesNoun(self.connection)
        self.traffic = TrafficNoun(self.connection)
        self.twins = TwinsNoun(self.connection)
        self.vehicles = VehiclesNoun(self.connection)

    def wheel(self, vehicle: str, reason: str = "") -> AbstractContextManager[Wheel]:
        """Drive a car; with a reason, one that somebody else has. See `scm.client.teleop`."""
        return acquired(self.connection, vehicle, reason)

    def wait(
        self,
        work: Operation,
        on_progress: Callable[[Operation], object] | None = None,
        timeout_s: float = 600.0,
    ) -> Operation:
        """Return long work once it is done; `on_progress` gets each step; see `scm.client.work`."""
        return finished(self.connection, work, on_progress, timeout_s)

    def close(self) -> None:
        """End the connection."""
        self.connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
