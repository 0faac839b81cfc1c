"""One stay in the city: from joining to leaving, twenty milliseconds at a time.

hear -> move the body up to now -> decide -> guard -> command the body -> report
"""

import logging

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import MapError
from scm.log import event
from scm.maps.route import Roads
from scm.records.city_map import CityMap
from scm.v2x.cam_trigger import CamTrigger
from scm.v2x.congestion import StationControl
from scm.v2x.etsi.convert import cam_of
from scm.v2x.etsi.events import CarWarnings
from scm.v2x.etsi.path import LowFrequencySender
from scm.v2x.exchange import Outgoing
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.contact import Contact
from scm.v2x.messages.denm_tx import DenmTx
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.route_request import RouteReply, RouteRequest
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.driver import RouteView
from scm.vehicles.drivers.cam_tracker import CamTracker
from scm.vehicles.drivers.channel import is_ideal
from scm.vehicles.drivers.signal_table import SignalTable
from scm.vehicles.drivers.single_car import OWN, TripDriver
from scm.vehicles.guard import Guard, Guarded
from scm.vehicles.lights import OFF, TURNS, Headlights, Indicators, Switches, lamps
from vehicle_agent.actuation import LastWord
from vehicle_agent.body import Body
from vehicle_agent.guard import RealGuard

_log = logging.getLogger(__name__)


class Stay:
    """A car in the city.

    Attributes:
        signals: What it believes of the signals.
        cars: What it knows of the others.
        guard: Between every commander and the body.
        trips: Where it is sent.
        switches: How its headlights and indicators are switched.
        air: How busy it is, and how seldom the car may speak.
        last_word: Between the guard and the body.
        astray: Why it cannot drive from where it was put; empty: it can.
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
        """Begin with the body where the city wants it; `real` guards a real car.

        Raises:
            MapError: when it stands where no lane leads anywhere.
        """
        self._vehicle, self._car, self._body = vehicle, car, body
        self.signals = SignalTable(city_map)
        self.cars = CamTracker()
        self.guard = Guard(epoch)
        self._roads = Roads(city_map)
        self.trips = TripDriver(vehicle, self._roads, body.limits, body.motion().pose, now_ns)
        self.last_word = LastWord(body, real)
        self.astray = ""
        self._tried_ns = now_ns
        self.switches = OFF
        radio = city_map.radio
        self.air = StationControl(radio.data_rate_mbps, is_on=radio.congestion_control)
        self._loses_nothing = is_ideal(radio)
        self._cam = CamTrigger()
        self._slow_news = LowFrequencySender()
        self._warnings = CarWarnings(vehicle)
        self._hits: list[Contact] = []
        self._seq = self._felt = 0
        self._commanded = 0.0, 0.0
        self._turn: Indicators = "off"
        self._is_led = False

    def see(self, track: EyeTrack, now_ns: int) -> None:
        """Learn where the overhead cameras see the car."""
        self.last_word.see(track, now_ns)

    def push(self, contact: Contact) -> None:
        """Let the body feel a contact; the next report says so."""
        self._body.push(contact)
        self._hits.append(contact)
        self._felt = contact.number

    def begin(self, request: RouteRequest, now_ns: int) -> RouteReply:
        """Send the car on a trip; MapError when the lanes do not allow it."""
        return self.trips.begin(request, self._body.motion().pose, now_ns)

    def told(self, headlights: Headlights | None, indicators: Indicators | None) -> Switches:
        """Switch the lights, None leaves one as it is; return how they stand."""
        self.switches = self.switches.updated(headlights, indicators)
        return self.switches

    def step(self, now_ns: int, epoch: int | None, *, sensed: bool = True) -> list[Outgoing]:
        """Drive and report.

        Args:
            now_ns: The present time [ns].
            epoch: Under which the car's own driver commands; None: it must not.
            sensed: Whether anybody subscribes to what the sensors read.
        """
        self._body.advance(now_ns)
        self._begin_anew_if_lifted(now_ns)
        led_here, self._turn, self._is_led = self._commanded, "off", epoch is None
        if epoch is not None:
            throttle, steering = self._decide(now_ns)
            self.guard.drive(throttle, steering, epoch, self._seq, now_ns)
        self._body.show(self._shown(hazard=self.guard.lost))
        guarded = self.last_word.pass_on(self.guard.output(now_ns), self.astray, now_ns)
        self._commanded = guarded.throttle, guarded.steering
        return self._reports(guarded, led_here, now_ns, sensed=sensed)

    def _begin_anew_if_lifted(self, now_ns: int) -> None:
        """Look for the lane again where the car was put down, until it stands on one."""
        is_due = self.astray and now_ns - self._tried_ns >= NS_PER_S
        if not (self._body.was_lifted() or is_due):
            return
        self._tried_ns, pose = now_ns, self._body.motion().pose
        try:
            self.trips = TripDriver(self._vehicle, self._roads, self._body.limits, pose, now_ns)
            self.astray = ""
        except MapError as error:
            self.astray = str(error)
        event(_log, "put_down", x_m=round(pose.x, 3), y_m=round(pose.y, 3), trouble=self.astray)

    def _shown(self, *, hazard: bool) -> Switches:
        """Return what a body's own lamps are to show."""
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
            reception_is_good=self._loses_nothing or self.cars.reception_is_good(now_ns),
        )
        throttle, steering = self.trips.decide(view)
        self._turn = TURNS[int(self.trips.driver.batch.turn[OWN])]
        return throttle, steering

    def _reports(
        self, guarded: Guarded, led_here: tuple[float, float], now_ns: int, *, sensed: bool
    ) -> list[Outgoing]:
        state = self._state(guarded, led_here, now_ns)
        sensors = self._body.sensors(self._vehicle, now_ns, wanted=sensed)
        outbox: list[Outgoing] = [state, *sensors]
        if self._cam.due(state, now_ns, self.air.gap_ns(now_ns)):
            self.air.add_frame("cam", now_ns)
            limits = self._body.limits
            body = cam_of(
                state,
                length_m=limits.length,
                width_m=limits.width,
                front_m=limits.front,
                low_frequency=self._slow_news.due(state, limits.front),
            )
            outbox.append(CamTx(station=self._vehicle, t_ns=now_ns, body=body))
        hits, self._hits = tuple(self._hits), []
        outbox += [
            DenmTx(station=self._vehicle, t_ns=now_ns, body=body)
            for body in self._warnings.step(state, hits)
        ]
        return [*outbox, *self.trips.reports(now_ns)]

    def _command_age_ms(self, now_ns: int) -> float | None:
        """Return the age of the newest command of somebody else who drives it."""
        age_ns = self.guard.command_age_ns(now_ns) if self._is_led else None
        return None if age_ns is None else age_ns / NS_PER_MS

    def _state(self, guarded: Guarded, led_here: tuple[float, float], now_ns: int) -> VehicleState:
        motion = self._body.motion()
        throttle, steering = led_here
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
            contacts=self._felt,
        )
