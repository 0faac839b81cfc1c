"""The binary stream of the map: every car's state as one row of numbers, encoded once for all.

The stream is a row of frames, all numbers little-endian:

    uint32   how many bytes follow
    uint8    layout version, 1
    uint8    what it is: 1 names, 2 states
    uint16   0
    ...      the body

Names (UTF-8 JSON) come first, and again whenever they changed: `{"generation", "vehicles": [{
"vehicle", "kind", "car", "owner", "tag_id"}], "modes": [...], "waits": [...], "lights": [...]}`.

States begin with uint32 generation, uint32 count, float64 world time [s], float32 age of the
snapshot [ms], float32 real-time factor; then come `count` float32 of each of x [m], y [m], yaw
[rad], speed [m/s], steering [rad], age [ms], driven [m] and length of the trip [m] (NaN: no trip,
infinity: without end), column after column, and `count` uint32 of flags: bit 0 alive, bits 1 to 5
mode, or `stuck`, bits 6 to 10 what it waits for (0 nothing), bits 11 to 31 lights, each a number in
its list of names. Row i is vehicle i of the names with the same generation.

A viewer that is slow gets the newest states, never a backlog.
"""

import asyncio
import struct
from collections.abc import AsyncIterator, Sequence

import msgspec
import numpy as np

from scm.api.encoding import encode
from scm.api.picture import Held
from scm.api.view import CityView
from scm.clock import NS_PER_S, seconds
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

VERSION, NAMES, STATES = 1, 1, 2
MEDIA_TYPE = "application/octet-stream"
COLUMNS = ("x_m", "y_m", "yaw_rad", "speed_mps", "steering_rad", "age_ms", "done_m", "length_m")
LOOK_S = 0.02
HEARTBEAT_LOOKS = 50  # looks without news until the last states are sent again: shows that we live
MOST_WORDS = 31  # five bits
MOST_LIGHTS = 21
TRIP_SHOWN_S = 10.0

_HEAD = struct.Struct("<IBBH")
_STATES_HEAD = struct.Struct("<IIdff")


class NamedVehicle(msgspec.Struct, kw_only=True, frozen=True):
    """What of a car hardly ever changes."""

    vehicle: str
    kind: str
    car: str
    owner: str
    tag_id: int


class Words:
    """Words numbered as they first appear, at most so many; those beyond share the last number."""

    def __init__(self, most: int, *first: str) -> None:
        self.list = list(first)
        self._numbers = {word: number for number, word in enumerate(first)}
        self._most = most

    def number(self, word: str) -> int:
        """Return a word's number; a new one is added."""
        number = self._numbers.get(word)
        if number is None:
            number = self._numbers[word] = min(len(self.list), self._most - 1)
            if len(self.list) < self._most:
                self.list.append(word)
        return number


class VehicleFrames:
    """The frames of one city, for all who listen; `run` it in the event loop that serves them."""

    def __init__(self, view: CityView) -> None:
        self._view = view
        self._vehicles: tuple[NamedVehicle, ...] = ()
        self._modes, self._waits = Words(MOST_WORDS, "idle"), Words(MOST_WORDS, "")
        self._lights = Words(MOST_LIGHTS)
        self._sent_words = (0, 0, 0)
        self._generation = 0
        self._names = b""
        self._states = b""
        self._sequence = 0
        self._shown: Held[WorldSnapshot] | None = None
        self._listeners = 0
        self._news = asyncio.Event()
        self._closed = False

    async def run(self) -> None:
        """Encode each new snapshot while anybody listens, until `close`."""
        silent = 0
        while not self._closed:
            silent = 0 if self.look() else silent + 1
            if silent and silent % HEARTBEAT_LOOKS == 0:
                self._notify()
            await asyncio.sleep(LOOK_S)

    def close(self) -> None:
        """End all streams; call it in the event loop."""
        self._closed = True
        self._notify()

    def look(self) -> bool:
        """Encode the newest snapshot if it is new and somebody listens; return whether it was."""
        held = self._view.snapshot
        if held is None or held is self._shown or not self._listeners:
            return False
        self._shown = held
        self._encode(held)
        self._notify()
        return True

    async def listen(self) -> AsyncIterator[bytes]:
        """Yield names and states, the newest each time, until the server ends."""
        self._listeners += 1
        generation, sequence = -1, -1
        try:
            self.look()
            while not self._closed:
                if self._sequence == sequence or not self._states:
                    await self._news.wait()
                sequence = self._sequence
                parts = [self._states]
                if generation != self._generation:
                    generation = self._generation
                    parts.insert(0, self._names)
                if self._states and not self._closed:
                    yield b"".join(parts)
        finally:
            self._listeners -= 1

    def _notify(self) -> None:
        self._sequence += 1
        self._news.set()
        self._news = asyncio.Event()

    def _encode(self, held: Held[WorldSnapshot]) -> None:
        snapshot, now_ns = held.message, self._view.now_ns
        cars = sorted(snapshot.vehicles, key=lambda car: car.vehicle)
        trips = self._view.trips
        shown = [_trip(trips.get(car.vehicle), now_ns) for car in cars]
        flags = [self._flags(car, trip) for car, trip in zip(cars, shown, strict=True)]
        self._name(cars)
        rows = [_numbers(car, trip) for car, trip in zip(cars, shown, strict=True)]
        table = np.array(rows, "<f4").reshape(-1, len(COLUMNS)).T
        head = _STATES_HEAD.pack(
            self._generation,
            len(cars),
            snapshot.t_ns / NS_PER_S,
            1e3 * seconds(now_ns - held.arrived_ns),
            snapshot.real_time_factor,
        )
        self._states = _frame(STATES, head + table.tobytes() + np.array(flags, "<u4").tobytes())

    def _name(self, cars: Sequence[SnapshotVehicle]) -> None:
        """Rebuild the table of names if it differs from the last one sent."""
        vehicles = tuple(
            NamedVehicle(
                vehicle=car.vehicle, kind=car.kind, car=car.car, owner=car.owner, tag_id=car.tag_id
            )
            for car in cars
        )
        words = (len(self._modes.list), len(self._waits.list), len(self._lights.list))
        if vehicles == self._vehicles and words == self._sent_words and self._names:
            return
        self._vehicles, self._sent_words = vehicles, words
        self._generation += 1
        body = {
            "generation": self._generation,
            "vehicles": vehicles,
            "modes": self._modes.list,
            "waits": self._waits.list,
            "lights": self._lights.list,
        }
        self._names = _frame(NAMES, encode(body))

    def _flags(self, car: SnapshotVehicle, trip: Trip | None) -> int:
        waits = "" if trip is None or trip.waiting_for is None else trip.waiting_for
        lights = sum(1 << number for number in {self._lights.number(name) for name in car.lights})
        return (
            int(car.alive)
            | self._modes.number(car.mode if car.stuck is None else "stuck") << 1
            | self._waits.number(waits) << 6
            | lights << 11
        )


def _numbers(car: SnapshotVehicle, trip: Trip | None) -> tuple[float, ...]:
    done_m, length_m = float("nan"), float("nan")
    if trip is not None:
        done_m = trip.done_m
        length_m = float("inf") if trip.length_m is None else trip.length_m
    return (
        car.x_m,
        car.y_m,
        car.yaw_rad,
        car.speed_mps,
        car.steering_rad,
        car.age_ms,
        done_m,
        length_m,
    )


def _trip(held: Held[Trip] | None, now_ns: int) -> Trip | None:
    """Return a trip that is under way and was reported lately."""
    if held is None or held.age_s(now_ns) > TRIP_SHOWN_S or held.message.arrived_ns is not None:
        return None
    return held.message


def _frame(kind: int, body: bytes) -> bytes:
    return _HEAD.pack(len(body) + _HEAD.size - 4, VERSION, kind, 0) + body
