"""A car that somebody drove continues to its destination: its trip ended when it was leased."""

from scm.api.view import CityView
from scm.clock import NS_PER_S
from scm.v2x.messages.route_request import RouteRequest
from scm.v2x.messages.trip import Trip

RESUME_NS = 2 * NS_PER_S  # an agent first waits to be sure that it is no longer driven
RESUME_PAUSE_S = 0.1
TRIP_KNOWN_S = 10.0


def trip_of(view: CityView, vehicle: str) -> Trip | None:
    """Return the trip that a car is on; None: on none that is known."""
    held = view.trips.get(vehicle)
    if held is None or held.message.arrived_ns is not None:
        return None
    return held.message if held.age_s(view.now_ns) <= TRIP_KNOWN_S else None


def onward(view: CityView, trip: Trip) -> RouteRequest:
    """Return the request that sends a car on: the rest of its trip when it was leased."""
    last = view.trips.get(trip.vehicle)
    if last is not None and last.message.trip_id == trip.trip_id:
        trip = last.message  # as it was when the car was taken
    return RouteRequest(
        vehicle=trip.vehicle, via=trip.via, speed_mps=trip.speed_mps, then=trip.then
    )
