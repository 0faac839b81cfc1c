"""An emulated Nigel that notes what its board obeys: `python -m tests.e2e.board_log FILE ...`.

A line of FILE is a change of the pins: when the sketch made it [ns], the throttle that its motor
was given and the angle that its servo was given [rad].
"""

import sys
from pathlib import Path

from vehicle_agent.__main__ import main
from vehicle_agent.emulate.firmware import Firmware
from vehicle_agent.emulate.wheels import throttle_of, wheel_angle


def noting(path):
    """Let every firmware of this process note what it obeys."""
    file = path.open("w", encoding="utf-8", buffering=1)
    obeys = Firmware._on_message

    def note(self, place, data):
        obeys(self, place, data)
        angle = wheel_angle(self.outputs, self.sketch.at_setup) or 0.0
        file.write(f"{self._next_ns},{throttle_of(self.outputs, 0.0):.6f},{angle:.6f}\n")

    Firmware._on_message = note


if __name__ == "__main__":
    noting(Path(sys.argv[1]))
    sys.exit(main(sys.argv[2:]))
