"""Which recorded channel drives a car: its throttle, or a speed where it has a speed control."""

from scm.recording.read import Recording
from scm.vehicles.car import Car

# what a driver commands of a car whose throttle means a speed, best first
COMMANDED_SPEEDS = ("command.speed", "command.acceleration")
SPEEDS = (*COMMANDED_SPEEDS, "speed")


def drive_name(recording: Recording, car: Car) -> str:
    """Return the channel that drives a car: a speed only where the car has a speed control."""
    if any(term.name == "speed_control" for term in car.terms):
        return next((name for name in SPEEDS if name in recording.channels), SPEEDS[0])
    return "command.throttle"
