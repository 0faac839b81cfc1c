"""The published firmware on its Arduino, exact to the byte and the millisecond.

No thread, no clock, no port: bytes and the present time in, bytes and the states of the pins out.

    no power, or in the bootloader (2 s after each reset): pins at rest, input ignored
    -- boots -->  servo straight, motor neither driven nor braked
    -- a message -->  obeys it until the next one, for ever
"""

from scm.clock import NS_PER_MS, NS_PER_S
from vehicle_agent.emulate.node_handle import NodeHandle
from vehicle_agent.emulate.sketches import Outputs, Sketch
from vehicle_agent.emulate.uart import Uart

BOOT_NS = 2 * NS_PER_S
"""How long the bootloader waits for a new sketch."""
MAX_PAST = 1000
LOOP_NS = NS_PER_MS
"""The sketch's `delay(1)`; the rest of a loop takes some ten microseconds."""


class Firmware:
    """One board with one sketch, switched on at `now_ns`.

    Attributes:
        outputs: The pins now.
        resets: Number of resets since it was switched on.
        past: Earlier pin states and when they ended [ns], oldest first; the reader clears it.
    """

    def __init__(self, sketch: Sketch, now_ns: int = 0) -> None:
        self.sketch = sketch
        self.resets = -1
        self.past: list[tuple[int, Outputs]] = []
        self._uart = Uart(sketch.baud)
        self.reset(now_ns)

    @property
    def configured(self) -> bool:
        """Whether the device considers a host connected; it obeys either way."""
        return self._node.configured

    @property
    def is_running(self) -> bool:
        """Whether the sketch runs, and not the bootloader."""
        return self._runs

    @property
    def is_lost(self) -> bool:
        """Whether the sketch has crashed, until the next reset; pins stay."""
        return self._node.has_crashed

    @property
    def lost_bytes(self) -> int:
        """Number of bytes lost for lack of room."""
        return self._uart.lost

    def backlog_ns(self, now_ns: int) -> int:
        """Return how long the line is occupied by bytes that the host sent already."""
        return self._uart.backlog_ns(now_ns)

    def reset(self, now_ns: int) -> None:
        """Reset: when a host opens the port (DTR), or the power returns."""
        self.resets += 1
        self.outputs = Outputs()
        self._runs = False
        self._booted_ns = self._next_ns = now_ns + BOOT_NS
        self._uart.clear(now_ns)
        self._node = NodeHandle(
            self.sketch.topics, self.sketch.buffer, self._on_message, self._write
        )

    def step(self, now_ns: int, data: bytes = b"") -> bytes:
        """Advance the device to now; return its output since the last call.

        Args:
            now_ns: The present time [ns].
            data: Bytes that the host sends from now on, at the line's rate.
        """
        while self._next_ns <= now_ns:
            self._loop()
        self._uart.arrive(now_ns, deaf=not self._runs)
        self._uart.put(data, now_ns)
        return self._uart.sent(now_ns)

    def _loop(self) -> None:
        t_ns = self._next_ns
        self._uart.arrive(t_ns, deaf=not self._runs)
        if not self._runs:
            self._runs, self.outputs = True, self.sketch.at_setup
        self._free_ns = t_ns
        if not self.is_lost:
            self._node.spin((t_ns - self._booted_ns) // NS_PER_MS, self._uart.read)
        self._next_ns = self._free_ns + LOOP_NS

    def _write(self, data: bytes) -> None:
        self._free_ns = self._uart.write(data, self._free_ns)

    def _on_message(self, place: int, data: float) -> None:
        respond = (self.sketch.steer, self.sketch.drive)[place]
        before, self.outputs = self.outputs, respond(self.outputs, data)
        if self.outputs != before:
            self.past = [*self.past[-MAX_PAST:], (self._next_ns, before)]
