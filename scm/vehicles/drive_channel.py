"""Which recorded channel commands a car: throttle, or speed for a car with a speed control."""

from scm.recording.read import Recording
from scm.vehicles.car import Car

# commands of a car whose throttle means a speed, best first
COMMANDED_SPEEDS = ("command.speed", "command.acceleration")
SPEEDS = (*COMMANDED_SPEEDS, "speed")


def drive_name(recording: Recording, car: Car) -> str:
    """Return the channel that commands a car: a speed only if the car has a speed control."""
    if any(term.name == "speed_control" for term in car.terms):
        return next((name for name in SPEEDS if name in recording.channels), SPEEDS[0])
    return "command.throttle"
