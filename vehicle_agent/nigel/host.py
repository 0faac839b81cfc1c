"""The host's side of rosserial, as a state machine without port or clock: bytes in, frames out.

    closed    -- the port opened, which resets the Arduino -->   boots
    boots     -- 2.1 s -->                                       requests: tx-stop, topics
    requests  -- steering and throttle announced twice alike --> ready: commands at 50 Hz
    ready     -- nothing for 5 s, or no telemetry, if it has any, for 1 s --> requests again
    ready     -- nothing for 3 x 5 s -->                         silent: zeros only
    silent    -- any frame -->                                   ready

Topics are identified by name; a topic number counts only when it was announced twice alike, because
one wrong number would send the steering to the motors and rosserial's checksums do not detect every
flipped bit. The published firmware is silent after a reset until it gets a request, yet obeys
commands: so commands continue while topics are requested again.
"""

import math
import re
from dataclasses import dataclass
from typing import Literal

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MessageError
from vehicle_agent.nigel.rosserial import (
    FLOAT32,
    FLOAT32_MD5,
    PUBLISHER_INFO,
    REQUEST_TOPICS,
    STOP_SENDING,
    SUBSCRIBER_INFO,
    TIME,
    Decoder,
    Frame,
    TopicInfo,
    pack,
    pack_float,
    pack_time,
    unpack_float,
    unpack_topic_info,
)
from vehicle_agent.nigel.telemetry import (
    FLOATS,
    FLOATS_MD5,
    Telemetry,
    telemetry_of,
    unpack_floats,
    unwrapped,
)

NANO_BAUD, MEGA_BAUD = 57600, 115200

BOOT_NS = 2100 * NS_PER_MS
REQUEST_EVERY_NS = 200 * NS_PER_MS
MAX_SILENCE_NS = 5 * NS_PER_S  # of the board before it is addressed anew
MAX_SILENCES = 3
TELEMETRY_SILENCE_NS = NS_PER_S
COMMAND_EVERY_NS = 20 * NS_PER_MS
MIN_REPLY_GAP_NS = 50 * NS_PER_MS
"""Minimum time between two answers to the device: commands must find room on the line."""
NO_ANSWER_NS = 3 * NS_PER_S
"""Time from the first request until a missing answer is reported."""

Phase = Literal["closed", "boots", "requests", "ready", "silent"]
Role = Literal["steering", "throttle", "lamps", "telemetry", "battery"]

_NAMES: dict[str, Role] = {
    r"steer_cmd|autodrive/[^/]+/steering_command": "steering",
    r"drive_cmd|autodrive/[^/]+/throttle_command": "throttle",
    r"light_cmd": "lamps",
    r"telemetry": "telemetry",
    r"battery_v": "battery",
}
_PUBLISHED: tuple[Role, ...] = ("telemetry", "battery")
_FIRST, _LAST = 100, 149
"""Range of topic numbers of the Arduino library: 25 subscribers, then 25 publishers."""


@dataclass(frozen=True, slots=True)
class NigelCommand:
    """A command for the car.

    Attributes:
        throttle: -1 to 1, + = forward; likewise `steering`, + = left. NaN counts as zero.
        lamps: 1 low beam, 2 high beam, 4 left, 8 right, added up.
    """

    throttle: float = 0.0
    steering: float = 0.0
    lamps: int = 0


REST = NigelCommand()


class Host:
    """One conversation with one Arduino.

    Attributes:
        phase: See the module.
        trouble: What prevents driving, in words; empty if nothing does.
        battery_v: As the firmware reports it; None if it does not.
        telemetry: The newest reading; None if this firmware has none.
        readings: Number of telemetry readings received.
        commanded: Command in the frames of the last `frames_due`; None if there was none.
    """

    def __init__(self, baud: int = NANO_BAUD) -> None:
        self._baud = baud
        self.phase: Phase = "closed"
        self.readings = 0
        self.close()

    def open(self, now_ns: int) -> None:
        """Restart: the port was just opened, and the Arduino boots."""
        self.close()
        self.phase, self.trouble = "boots", "the Arduino starts"
        self._since_ns = self._received_ns = now_ns

    def close(self) -> None:
        """Reset the state: the port is closed."""
        self.phase = "closed"
        self.trouble = "the port is closed"
        self._decoder = Decoder()
        self._topics: dict[Role, int] = {}
        self._candidates: dict[Role, int] = {}
        self.battery_v: float | None = None
        self.telemetry: Telemetry | None = None
        self._since_ns = self._received_ns = self._telemetry_ns = 0
        self._requested_ns: int | None = None
        self._timed_ns: int | None = None
        self._due_ns: int | None = None
        self.commanded: NigelCommand | None = None
        self._is_moving = False
        self._refusal = ""
        self._must_request = False

    def receive(self, data: bytes, now_ns: int) -> list[bytes]:
        """Process bytes from the device; return the frames that answer at once."""
        if self.phase == "closed":
            return []
        answers = list[bytes]()
        for frame in self._decoder.feed(data, now_ns):
            self._received_ns = now_ns
            if frame.topic == TIME:
                answers += self._time(now_ns)
            elif frame.topic in (PUBLISHER_INFO, SUBSCRIBER_INFO):
                self._announced(frame)
            else:
                self._read(frame, now_ns)
        return answers

    def frames_due(self, command: NigelCommand, now_ns: int) -> list[bytes]:
        """Return the frames that are due: topic requests, and commands at 50 Hz once it is ready.

        A throttle that falls to zero is sent at once.
        """
        self.commanded = None
        if self.phase == "closed":
            return []
        if self.phase == "boots":
            if now_ns - self._since_ns < BOOT_NS:
                return []
            self.phase, self._since_ns = "requests", now_ns
        self._update_phase(now_ns)
        frames = self._topic_requests(now_ns)
        due = command if self.phase == "ready" else REST
        if self._is_command_due(now_ns, due):
            commands = self._commands(due)
            self.commanded = due if commands else None
            frames += commands
        return frames

    def rest(self) -> list[bytes]:
        """Return frames with zero steering and throttle; none while topic numbers are unknown."""
        return self._commands(REST)

    def _time(self, now_ns: int) -> list[bytes]:
        if self._timed_ns is not None and now_ns - self._timed_ns < MIN_REPLY_GAP_NS:
            return []
        self._timed_ns = now_ns
        return [pack(Frame(TIME, pack_time(now_ns)))]

    def _announced(self, frame: Frame) -> None:
        try:
            info = unpack_topic_info(frame.payload)
        except MessageError:
            return
        role = _role_of(info.name)
        if role is None or (role in _PUBLISHED) != (frame.topic == PUBLISHER_INFO):
            return
        expected = (FLOATS, FLOATS_MD5) if role == "telemetry" else (FLOAT32, FLOAT32_MD5)
        if (info.kind, info.md5) != expected:
            self._refusal = (
                f"topic {info.name}: got {info.kind} {info.md5}, expected {' '.join(expected)}"
            )
            return
        self._learn(role, info)

    def _learn(self, role: Role, info: TopicInfo) -> None:
        used = [number for other, number in self._topics.items() if other != role]
        if not _FIRST <= info.number <= _LAST or info.number in used:
            self._refusal = f"topic {info.name}: number {info.number} is in use or impossible"
        elif self._topics.get(role) == info.number:
            self._candidates.pop(role, None)
        elif self._candidates.get(role) == info.number:
            self._topics[role] = info.number
            del self._candidates[role]
        else:
            self._candidates[role] = info.number
            self._must_request = True

    def _read(self, frame: Frame, now_ns: int) -> None:
        try:
            if frame.topic == self._topics.get("battery"):
                value = unpack_float(frame.payload)
                self.battery_v = value if math.isfinite(value) else None
            elif frame.topic == self._topics.get("telemetry"):
                reading = telemetry_of(unpack_floats(frame.payload))
                self.telemetry = unwrapped(reading, self.telemetry)
                self.readings += 1
                self._telemetry_ns = now_ns
        except MessageError:
            return

    def _update_phase(self, now_ns: int) -> None:
        """Update phase and trouble from the known topics and the time since the last frame."""
        if {"steering", "throttle"} <= self._topics.keys():
            is_lost = now_ns - self._received_ns >= MAX_SILENCES * MAX_SILENCE_NS
            self.phase = "silent" if is_lost else "ready"
            self.trouble = "the Arduino has been silent for 15 s" if is_lost else ""
        elif self._refusal:
            self.trouble = self._refusal
        elif now_ns - self._since_ns < NO_ANSWER_NS:
            self.trouble = "requests the topics of the Arduino"
        else:
            self.trouble = self._no_answer()

    def _no_answer(self) -> str:
        other = MEGA_BAUD if self._baud == NANO_BAUD else NANO_BAUD
        speeds = f"it is {self._baud}; try --baud {other}"
        if self._received_ns > self._since_ns:
            return "the Arduino speaks rosserial, but has no steering and throttle topics"
        if self._decoder.skipped:
            return (
                f"{self._decoder.skipped} bytes came and no frame: "
                f"the baud rate looks wrong ({speeds}), or this is no rosserial firmware"
            )
        return f"no answer: wrong baud rate ({speeds}), no rosserial firmware, or no power"

    def _topic_requests(self, now_ns: int) -> list[bytes]:
        if self._requested_ns is None:
            frames = [pack(STOP_SENDING), pack(REQUEST_TOPICS)]
        elif self._is_request_due(now_ns, self._requested_ns):
            frames = [pack(REQUEST_TOPICS)]
        else:
            return []
        self._requested_ns, self._must_request = now_ns, False
        return frames

    def _is_request_due(self, now_ns: int, requested_ns: int) -> bool:
        if self._must_request:
            return now_ns - requested_ns >= MIN_REPLY_GAP_NS
        if self.phase != "ready":
            return now_ns - requested_ns >= REQUEST_EVERY_NS
        late_ns = now_ns - max(self._received_ns, requested_ns)
        if "telemetry" in self._topics:
            quiet_ns = now_ns - max(self._telemetry_ns, requested_ns)
            return late_ns >= MAX_SILENCE_NS or quiet_ns >= TELEMETRY_SILENCE_NS
        return late_ns >= MAX_SILENCE_NS

    def _is_command_due(self, now_ns: int, command: NigelCommand) -> bool:
        """Return whether a command must be sent now: at 50 Hz, and at once to stop a car."""
        stops = self._is_moving and clamped(command.throttle) == 0.0
        self._is_moving = clamped(command.throttle) != 0.0
        if self._due_ns is not None and now_ns < self._due_ns:
            return stops
        behind = self._due_ns is None or now_ns - self._due_ns >= COMMAND_EVERY_NS
        self._due_ns = (now_ns if behind else self._due_ns or 0) + COMMAND_EVERY_NS
        return True

    def _commands(self, command: NigelCommand) -> list[bytes]:
        if not {"steering", "throttle"} <= self._topics.keys():
            return []
        values: list[tuple[Role, float]] = [
            ("throttle", clamped(command.throttle)),
            ("steering", clamped(command.steering)),
            ("lamps", float(command.lamps & 0xF)),
        ]
        return [
            pack(Frame(self._topics[role], pack_float(value)))
            for role, value in values
            if role in self._topics
        ]


def clamped(value: float) -> float:
    """Return a command within -1 to 1, zero for NaN: the firmware does not check."""
    return min(1.0, max(-1.0, value)) if math.isfinite(value) else 0.0


def _role_of(name: str) -> Role | None:
    for pattern, role in _NAMES.items():
        if re.fullmatch(pattern, name.removeprefix("/")):
            return role
    return None
