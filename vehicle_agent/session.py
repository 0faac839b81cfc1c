"""One visit to the city: from joining to leaving, 20 ms a step.

receive -> advance the body to now -> decide -> guard -> command the body -> report
"""

import logging

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import LeaseError
from scm.log import event
from scm.maps.route import roads_of
from scm.records.city_map import CityMap
from scm.v2x.cam_trigger import CamTrigger
from scm.v2x.congestion import StationControl
from scm.v2x.etsi.convert import cam_of
from scm.v2x.etsi.events import CarWarnings
from scm.v2x.etsi.path import LowFrequencySender
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.cam import CamTx
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.denm import DenmTx
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.twin_status import TwinStatus
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.driver import RouteView
from scm.vehicles.drivers.cam_tracker import CamTracker
from scm.vehicles.drivers.channel import is_ideal
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.single_car import OWN, TripDriver
from scm.vehicles.guard import Guard, Guarded
from scm.vehicles.lights import OFF, TURNS, Headlights, Indicators, Switches, lamps
from vehicle_agent.actuation import ActuationGate
from vehicle_agent.body import Body
from vehicle_agent.changed_car import ChangedCar, changed_car
from vehicle_agent.guard import RealGuard

_log = logging.getLogger(__name__)


class CitySession:
    """A car in the city.

    Attributes:
        signals: State of the signals as received.
        cars: State of the other cars as received.
        guard: Between every source of commands and the body.
        trips: Its route and trip.
        switches: State of its headlights and indicators.
        channel: Channel load, and how often the car may transmit.
        gate: Between the guard and the body.
    """

    def __init__(
        self,
        vehicle: str,
        car: str,
        body: Body,
        city_map: CityMap,
        epoch: int,
        now_ns: int,
        real: RealGuard | None = None,
    ) -> None:
        """Begin with the body where the city placed it; `real` guards a real car."""
        self._vehicle, self._car, self._body = vehicle, car, body
        self.signals = SignalTable(city_map)
        self.cars = CamTracker()
        self.guard = Guard(epoch)
        self._roads = roads_of(city_map)
        self._map, self._changed = city_map, ChangedCar(body.limits)
        self.trips = TripDriver(vehicle, self._roads, body.limits, body.motion().pose, now_ns)
        self.gate = ActuationGate(body, real)
        self._tried_ns = now_ns
        self.switches = OFF
        radio = city_map.radio
        self.channel = StationControl(radio.data_rate_mbps, is_on=radio.congestion_control)
        self._is_lossless = is_ideal(radio)
        self._cam = CamTrigger()
        self._low_frequency = LowFrequencySender()
        self._warnings = CarWarnings(vehicle)
        self._contacts: list[Contact] = []
        self._seq = self._contact_number = 0
        self._last_command = 0.0, 0.0
        self._turn: Indicators = "off"
        self._is_driven_by_other = False

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Receive a track of the car from the overhead cameras."""
        self.gate.see(track, now_ns)

    def follow(self, status: TwinStatus) -> str:
        """Drive by the version of the car file that is in force; return what changes, in words."""
        changed, before = changed_car(status, self._body.limits, self._map), self._changed
        self._changed = changed
        self.trips.use_limits(changed.limits)
        self.gate.assume_decel(changed.decel_mps2)
        if changed.unfit != before.unfit:
            unfit = changed.unfit
            return f"{self._vehicle} {f'does not drive: {unfit}' if unfit else 'may drive again'}"
        if changed.limits.decel != before.limits.decel:
            braking = f"{changed.limits.decel:.2g} m/s2, before {before.limits.decel:.2g}"
            return f"{self._vehicle} brakes with {braking}, by version {status.version}"
        return ""

    def push(self, contact: Contact) -> None:
        """Apply a contact to the body; the next report includes it."""
        self._body.push(contact)
        self._contacts.append(contact)
        self._contact_number = contact.number

    def begin(self, request: RouteRequest, now_ns: int) -> RouteReply:
        """Start a trip.

        Raises:
            MapError: when the lanes do not allow it.
            LeaseError: when the request may replace only a trip that the car is not on, or the car
                must not drive.
        """
        if request.replaces and self._changed.unfit:
            raise LeaseError(f"it does not drive: {self._changed.unfit}")
        return self.trips.begin(request, self._body.motion().pose, now_ns)

    def switch_lights(
        self, headlights: Headlights | None, indicators: Indicators | None
    ) -> Switches:
        """Switch the lights (None leaves one unchanged) and return their state."""
        self.switches = self.switches.updated(headlights, indicators)
        return self.switches

    def step(self, now_ns: int, epoch: int | None, *, sensed: bool = True) -> list[Outgoing]:
        """Drive and report.

        Args:
            now_ns: The present time [ns].
            epoch: Under which the car's own driver commands; None: it may not drive.
            sensed: Whether anybody subscribes to the sensors.
        """
        self._body.advance(now_ns)
        self._replan_if_lifted(now_ns)
        previous_command, self._turn, self._is_driven_by_other = (
            self._last_command,
            "off",
            epoch is None,
        )
        if epoch is not None:
            throttle, steering = self._decide(now_ns)
            self.guard.drive(throttle, steering, epoch, self._seq, now_ns)
        self._body.show(self._lamp_switches(hazard=self.guard.lost))
        off_lane = "" if self._is_driven_by_other else self.trips.off_lane or self._changed.unfit
        guarded = self.gate.pass_on(self.guard.output(now_ns), off_lane, now_ns)
        self._last_command = guarded.throttle, guarded.steering
        return self._reports(guarded, previous_command, now_ns, sensed=sensed)

    def _replan_if_lifted(self, now_ns: int) -> None:
        """Search for a lane where the car was put down, until it stands on one."""
        was_lifted, before = self._body.was_lifted(), self.trips.off_lane
        is_due = before and not self._is_driven_by_other and now_ns - self._tried_ns >= NS_PER_S
        if not (was_lifted or is_due):
            return
        self._tried_ns, pose = now_ns, self._body.motion().pose
        self.trips = TripDriver(self._vehicle, self._roads, self._changed.limits, pose, now_ns)
        off_lane = self.trips.off_lane
        if was_lifted or not off_lane:
            event(_log, "put_down", x_m=round(pose.x, 3), y_m=round(pose.y, 3), trouble=off_lane)

    def _lamp_switches(self, *, hazard: bool) -> Switches:
        """Return the state for the body's own lamps."""
        indicators = self._turn if self.switches.indicators == "off" else self.switches.indicators
        return Switches(self.switches.headlights, "hazard" if hazard else indicators)

    def _decide(self, now_ns: int) -> tuple[float, float]:
        """Return throttle and steering as the car's own driver wants them."""
        motion = self._body.motion()
        view = RouteView(
            now_ns=now_ns,
            pose=motion.pose,
            speed=motion.speed,
            signals=self.signals,
            others=self.cars.others(now_ns, motion.pose),
            reception_is_good=self._is_lossless or self.cars.reception_is_good(now_ns),
        )
        throttle, steering = self.trips.decide(view)
        self._turn = TURNS[int(self.trips.driver.batch.turn[OWN])]
        return throttle, steering

    def _reports(
        self, guarded: Guarded, previous_command: tuple[float, float], now_ns: int, *, sensed: bool
    ) -> list[Outgoing]:
        state = self._state(guarded, previous_command, now_ns)
        sensors = self._body.sensors(self._vehicle, now_ns, wanted=sensed)
        outbox: list[Outgoing] = [state, *sensors]
        if self._cam.due(state, now_ns, self.channel.gap_ns(now_ns)):
            self.channel.add_frame("cam", now_ns)
            limits = self._body.limits
            body = cam_of(
                state,
                length_m=limits.length,
                width_m=limits.width,
                front_m=limits.front,
                low_frequency=self._low_frequency.due(state, limits.front),
            )
            outbox.append(CamTx(station=self._vehicle, t_ns=now_ns, body=body))
        contacts, self._contacts = tuple(self._contacts), []
        outbox += [
            DenmTx(station=self._vehicle, t_ns=now_ns, body=body)
            for body in self._warnings.step(state, contacts)
        ]
        return [*outbox, *self.trips.reports(now_ns)]

    def _command_age_ms(self, now_ns: int) -> float | None:
        """Return the age of the newest command if somebody else drives the car."""
        age_ns = self.guard.command_age_ns(now_ns) if self._is_driven_by_other else None
        return None if age_ns is None else age_ns / NS_PER_MS

    def _state(
        self, guarded: Guarded, previous_command: tuple[float, float], now_ns: int
    ) -> VehicleState:
        motion = self._body.motion()
        throttle, steering = previous_command
        self._seq += 1
        return VehicleState(
            vehicle=self._vehicle,
            t_ns=now_ns,
            seq=self._seq,
            x_m=motion.pose.x,
            y_m=motion.pose.y,
            yaw_rad=motion.pose.yaw,
            speed_mps=motion.speed,
            lateral_speed_mps=motion.lateral_speed,
            yaw_rate_radps=motion.yaw_rate,
            accel_mps2=motion.accel,
            steering_rad=motion.steering,
            throttle=throttle,
            steering=steering,
            source=motion.source,
            epoch=self.guard.epoch,
            mode="stop" if guarded.mode == "lost" else guarded.mode,
            lights=lamps(
                self.switches,
                guarded.throttle,
                motion.speed,
                now_ns,
                hazard=guarded.hazard,
                turn=self._turn,
            ),
            car=self._car,
            battery_v=motion.battery_v,
            battery_charge=motion.battery_charge,
            command_age_ms=self._command_age_ms(now_ns),
            contacts=self._contact_number,
        )
