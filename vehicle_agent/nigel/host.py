"""The host's side of rosserial, as a state machine without port or clock: bytes in, frames out.

    closed    -- the port opened, which resets the Arduino -->   boots
    boots     -- 2.1 s -->                                       asks: tx-stop, request topics
    asks      -- steering and throttle announced twice alike --> ready: commands at 50 Hz
    ready     -- nothing for 5 s, or nothing of a telemetry of its own for 1 s --> asks again
    ready     -- nothing for 3 x 5 s -->                         silent: zeros only, asks again
    silent    -- any frame -->                                   ready

Topics are known by their names; a number counts only when it came twice alike, because one wrong
number would send the steering to the motors and rosserial's sums do not see every flipped bit. The
published firmware keeps silent after a reset until it is asked, and yet obeys: so commands go on
while it is asked again.
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
    carried_on,
    telemetry_of,
    unpack_floats,
)

NANO_BAUD, MEGA_BAUD = 57600, 115200

BOOT_NS = 2100 * NS_PER_MS
ASK_EVERY_NS = 200 * NS_PER_MS
SILENCE_NS = 5 * NS_PER_S
SILENCES = 3
TELEMETRY_SILENCE_NS = NS_PER_S
COMMAND_EVERY_NS = 20 * NS_PER_MS
LEAST_GAP_NS = 50 * NS_PER_MS
"""Between two answers to the device, whatever it sends: commands must find room on the line."""
PATIENCE_NS = 3 * NS_PER_S
"""From the first question until somebody is told that there is no answer."""

Phase = Literal["closed", "boots", "asks", "ready", "silent"]
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
"""Of the numbers that the Arduino library gives: 25 subscribers, then 25 publishers."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What the car is to do.

    Attributes:
        throttle: -1 to 1, + = forward; likewise `steering`, + = left. What is no number is zero.
        lamps: 1 low beam, 2 high beam, 4 left, 8 right, added up.
    """

    throttle: float = 0.0
    steering: float = 0.0
    lamps: int = 0


REST = Wish()


class Host:
    """One conversation with one Arduino.

    Attributes:
        phase: See the module.
        trouble: What keeps the car from being driven, in words; empty: nothing.
        battery_v: As the firmware says it; None: it does not.
        telemetry: The newest; None: this firmware has none.
        readings: How many telemetries have come.
        commanded: By the frames of the last `say`; None: they command nothing.
    """

    def __init__(self, baud: int = NANO_BAUD) -> None:
        self._baud = baud
        self.phase: Phase = "closed"
        self.readings = 0
        self.close()

    def open(self, now_ns: int) -> None:
        """Begin anew: the port has just opened, and the Arduino starts."""
        self.close()
        self.phase, self.trouble = "boots", "the Arduino starts"
        self._since_ns = self._heard_ns = now_ns

    def close(self) -> None:
        """Forget everything: the port is closed."""
        self.phase = "closed"
        self.trouble = "the port is closed"
        self._decoder = Decoder()
        self._topics: dict[Role, int] = {}
        self._once: dict[Role, int] = {}
        self.battery_v: float | None = None
        self.telemetry: Telemetry | None = None
        self._since_ns = self._heard_ns = self._telemetry_ns = 0
        self._asked_ns: int | None = None
        self._timed_ns: int | None = None
        self._due_ns: int | None = None
        self.commanded: Wish | None = None
        self._moves = False
        self._refusal = ""
        self._must_ask = False

    def hear(self, data: bytes, now_ns: int) -> list[bytes]:
        """Take what came from the device; return the frames that answer it at once."""
        if self.phase == "closed":
            return []
        answers = list[bytes]()
        for frame in self._decoder.feed(data, now_ns):
            self._heard_ns = now_ns
            if frame.topic == TIME:
                answers += self._time(now_ns)
            elif frame.topic in (PUBLISHER_INFO, SUBSCRIBER_INFO):
                self._announced(frame)
            else:
                self._read(frame, now_ns)
        return answers

    def say(self, wish: Wish, now_ns: int) -> list[bytes]:
        """Return the frames that are due: questions, and once it is ready commands at 50 Hz.

        Throttle that falls to zero waits for nothing.
        """
        self.commanded = None
        if self.phase == "closed":
            return []
        if self.phase == "boots":
            if now_ns - self._since_ns < BOOT_NS:
                return []
            self.phase, self._since_ns = "asks", now_ns
        self._judge(now_ns)
        frames = self._questions(now_ns)
        said = wish if self.phase == "ready" else REST
        if self._is_command_due(now_ns, said):
            commands = self._commands(said)
            self.commanded = said if commands else None
            frames += commands
        return frames

    def rest(self) -> list[bytes]:
        """Return zeros for steering and throttle, whatever was due; nothing while no one knows."""
        return self._commands(REST)

    def _time(self, now_ns: int) -> list[bytes]:
        if self._timed_ns is not None and now_ns - self._timed_ns < LEAST_GAP_NS:
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
        taken = [number for other, number in self._topics.items() if other != role]
        if not _FIRST <= info.number <= _LAST or info.number in taken:
            self._refusal = f"topic {info.name}: number {info.number} is taken or impossible"
        elif self._topics.get(role) == info.number:
            self._once.pop(role, None)
        elif self._once.get(role) == info.number:
            self._topics[role] = info.number
            del self._once[role]
        else:
            self._once[role] = info.number
            self._must_ask = True

    def _read(self, frame: Frame, now_ns: int) -> None:
        try:
            if frame.topic == self._topics.get("battery"):
                value = unpack_float(frame.payload)
                self.battery_v = value if math.isfinite(value) else None
            elif frame.topic == self._topics.get("telemetry"):
                told = telemetry_of(unpack_floats(frame.payload))
                self.telemetry = carried_on(told, self.telemetry)
                self.readings += 1
                self._telemetry_ns = now_ns
        except MessageError:
            return

    def _judge(self, now_ns: int) -> None:
        """Set the phase and the trouble from what is known and how long nothing came."""
        if {"steering", "throttle"} <= self._topics.keys():
            is_lost = now_ns - self._heard_ns >= SILENCES * SILENCE_NS
            self.phase = "silent" if is_lost else "ready"
            self.trouble = "the Arduino has been silent for 15 s" if is_lost else ""
        elif self._refusal:
            self.trouble = self._refusal
        elif now_ns - self._since_ns < PATIENCE_NS:
            self.trouble = "asks the Arduino for its topics"
        else:
            self.trouble = self._no_answer()

    def _no_answer(self) -> str:
        other = MEGA_BAUD if self._baud == NANO_BAUD else NANO_BAUD
        speeds = f"it is {self._baud}; try --baud {other}"
        if self._heard_ns > self._since_ns:
            return "the Arduino speaks rosserial, but names no steering and throttle topic"
        if self._decoder.skipped:
            return (
                f"{self._decoder.skipped} bytes came and no frame: "
                f"the baud rate looks wrong ({speeds}), or this is no rosserial firmware"
            )
        return f"no answer: wrong baud rate ({speeds}), no rosserial firmware, or no power"

    def _questions(self, now_ns: int) -> list[bytes]:
        if self._asked_ns is None:
            frames = [pack(STOP_SENDING), pack(REQUEST_TOPICS)]
        elif self._is_question_due(now_ns, self._asked_ns):
            frames = [pack(REQUEST_TOPICS)]
        else:
            return []
        self._asked_ns, self._must_ask = now_ns, False
        return frames

    def _is_question_due(self, now_ns: int, asked_ns: int) -> bool:
        if self._must_ask:
            return now_ns - asked_ns >= LEAST_GAP_NS
        if self.phase != "ready":
            return now_ns - asked_ns >= ASK_EVERY_NS
        late_ns = now_ns - max(self._heard_ns, asked_ns)
        if "telemetry" in self._topics:
            quiet_ns = now_ns - max(self._telemetry_ns, asked_ns)
            return late_ns >= SILENCE_NS or quiet_ns >= TELEMETRY_SILENCE_NS
        return late_ns >= SILENCE_NS

    def _is_command_due(self, now_ns: int, wish: Wish) -> bool:
        """Return whether a command must go out now: at 50 Hz, and at once to stop a car."""
        stops = self._moves and limited(wish.throttle) == 0.0
        self._moves = limited(wish.throttle) != 0.0
        if self._due_ns is not None and now_ns < self._due_ns:
            return stops
        behind = self._due_ns is None or now_ns - self._due_ns >= COMMAND_EVERY_NS
        self._due_ns = (now_ns if behind else self._due_ns or 0) + COMMAND_EVERY_NS
        return True

    def _commands(self, wish: Wish) -> list[bytes]:
        if not {"steering", "throttle"} <= self._topics.keys():
            return []
        said: list[tuple[Role, float]] = [
            ("throttle", limited(wish.throttle)),
            ("steering", limited(wish.steering)),
            ("lamps", float(wish.lamps & 0xF)),
        ]
        return [
            pack(Frame(self._topics[role], pack_float(value)))
            for role, value in said
            if role in self._topics
        ]


def limited(value: float) -> float:
    """Return a command within -1 to 1; zero for what is no number: the firmware does not ask."""
    return min(1.0, max(-1.0, value)) if math.isfinite(value) else 0.0


def _role_of(name: str) -> Role | None:
    for pattern, role in _NAMES.items():
        if re.fullmatch(pattern, name.removeprefix("/")):
            return role
    return None
