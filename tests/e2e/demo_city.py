"""A city made up for looking at the dashboard: cars on rails, a signal cycle, a painted Eye.

It feeds a `CityView` with the messages a real city would send, on a thread of its own, and answers
the requests a person can make. Run it to look at the page: `python tests/e2e/demo_city.py 8000`.
"""

import math
import sys
import threading

import cv2
import numpy as np

from scm.api.app import create_app
from scm.api.server import serve
from scm.api.view import CityView
from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.studio import Studio
from scm.clock import NS_PER_MS, NS_PER_S, WallClock
from scm.maps.load import load_map
from scm.maps.route import Path, Roads
from scm.v2x.exchange import Incoming
from scm.v2x.message import Refused
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.city_stop import CityStop
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_tags import EyeTags, TagSeen
from scm.v2x.messages.light_request import LightReply, LightRequest
from scm.v2x.messages.monitor_reset import MonitorReset
from scm.v2x.messages.monitor_status import MonitorStatus
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.plan_request import PlanReply, PlanRequest
from scm.v2x.messages.presence import Presence
from scm.v2x.messages.remove_request import RemoveReply, RemoveRequest
from scm.v2x.messages.spat import SignalGroup, Spat
from scm.v2x.messages.spawn_request import SpawnReply, SpawnRequest
from scm.v2x.messages.stop_request import StopRequest
from scm.v2x.messages.trip import Trip
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot
from scm.vehicles.car import load_car
from scm.vehicles.lights import OFF, lamps

PARTS = ("world", "traffic", "monitor", "eye", "api", "record")
KINDS = {"n5": "remote", "n6": "remote", "n7": "real"}
TICK_NS = 50 * NS_PER_MS
PX_PER_M = 230.0
CYCLE = (("green", 6.0), ("yellow", 1.0), ("red", 8.0))  # of the first group; the others follow


class DemoCity:
    def __init__(self, view, cars=6, seed=0):
        self.view = view
        self.city_map = load_map("driving_school")
        self.rng = np.random.default_rng(seed)
        roads = Roads(self.city_map)
        self.path = Path.circulation(roads, self.city_map.lanes[0].name)
        self.cars = {f"n{i + 1}": i * self.path.length_m / 7.0 + 0.3 for i in range(cars)}
        self.lost = set()
        self.silent = False
        self.eye_late_ns = 0
        self.eye_shut = False
        self.stopped = None
        self.plan = "calm"
        self.fault = None
        self.ask_refuses = ""
        self.switches = {}
        self.files = {}
        self.studio = None
        self.pictured = []
        self.tick = 0
        self.clock = WallClock()
        self._lock = threading.Lock()
        self._inbox = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        now_ns = self.clock.now_ns()
        for name in PARTS:
            self.say(Presence(role="part", station=name, session="a1b2c3", alive=True), now_ns)
        for name, kind in KINDS.items():
            if name in self.cars and kind != "hosted":
                self.say(Presence(role="v", station=name, session=f"{name}s", alive=True), now_ns)
        self.event("info", "world", "city_started", "Driving School is open, 4 hosted cars placed")
        self._thread.start()
        return self

    def __exit__(self, *exc):
        self._stop.set()
        self._thread.join()

    def say(self, message, t_ns=None):
        with self._lock:
            self._inbox.append(Incoming(message, t_ns or self.clock.now_ns()))

    def event(self, severity, source, name, text):
        now_ns = self.clock.now_ns()
        self.say(CityEvent(severity=severity, source=source, t_ns=now_ns, name=name, text=text))

    def lose(self, name):
        self.lost.add(name)
        self.say(Presence(role="v", station=name, session=f"{name}s", alive=False))
        self.event("warning", "world", "vehicle_lost", f"{name} is gone: its agent fell silent")

    def ask(self, request, timeout_s):
        now_ns = self.clock.now_ns()
        if self.ask_refuses:
            return Refused(code="owned", detail=self.ask_refuses)
        if isinstance(request, StopRequest):
            self.stopped = request if request.engaged else None
            text = f"city stop {'engaged' if request.engaged else 'released'} by {request.by}"
            self.event("warning", "world", "city_stop", text)
            stop = CityStop(
                t_ns=now_ns, engaged=request.engaged, by=request.by, reason=request.reason
            )
            self.say(stop)
            return stop
        if isinstance(request, PlanRequest):
            self.plan = request.plan
            self.event("info", "traffic", "plan_changed", f"plan {request.plan} is in force")
            return PlanReply(junction=request.junction, plan=request.plan)
        if isinstance(request, MonitorReset):
            self.fault = None
            return self.monitor(now_ns)
        if isinstance(request, SpawnRequest):
            name = request.vehicle or f"n{len(self.cars) + 1}"
            self.cars[name] = 0.0
            self.event("info", "world", "vehicle_spawned", f"{name} stands at north_west")
            return SpawnReply(vehicle=name, x_m=0.0, y_m=0.0, yaw_rad=0.0, tag_id=len(self.cars))
        if isinstance(request, RemoveRequest):
            if self.cars.pop(request.vehicle, None) is None:
                return Refused(code="not_found", detail=f"no car {request.vehicle}")
            self.event("info", "world", "vehicle_removed", f"{request.vehicle} was taken away")
            return RemoveReply(vehicle=request.vehicle)
        if isinstance(request, LightRequest):
            told = self.switches.get(request.vehicle, OFF)
            told = told.told(request.headlights, request.indicators)
            self.switches[request.vehicle] = told
            return LightReply(
                vehicle=request.vehicle, headlights=told.headlights, indicators=told.indicators
            )
        return Refused(code="timeout", detail=f"{type(request).__name__}: no answer")

    def _run(self):
        next_ns = self.clock.now_ns()
        while not self._stop.is_set():
            self.advance(self.clock.now_ns())
            next_ns += TICK_NS
            self.clock.wait_until(next_ns, self._stop)

    def advance(self, now_ns):
        self.tick += 1
        if not self.silent:
            self._move()
            self.say(self.snapshot(now_ns), now_ns)
            if self.tick % 2 == 0:
                self.say(self.spat(now_ns), now_ns)
            if self.tick % 4 == 0:
                for message in () if self.eye_shut else self.eye(now_ns - self.eye_late_ns):
                    self.say(message, now_ns)
                self._picture_cameras(now_ns)
            if self.tick % 10 == 0:
                self._slow(now_ns)
        with self._lock:
            inbox, self._inbox = self._inbox, []
        self.view.step(now_ns, inbox)

    def _picture_cameras(self, now_ns):
        """Send a picture of each camera that the page watches, as the real city does."""
        for hears in self.view.hears:
            if hears.kind is not CameraFrame:
                continue
            self.pictured.append(tuple(hears.where.values()))
            self.studio = self.studio or Studio(self.city_map, Daylight())
            cars = self.snapshot(now_ns).vehicles
            own = next(car for car in cars if car.vehicle == hears.where["vehicle"])
            optics = optics_of(load_car("nigel"), hears.where["camera"])
            shown = {light.light_id: "green" for light in self.city_map.lights}
            image = self.studio.picture(optics, own, cars, shown, hears.where["camera"], now_ns)
            frame = CameraFrame(
                **hears.where,
                t_ns=now_ns,
                width_px=image.shape[1],
                height_px=image.shape[0],
                payload=cv2.imencode(".jpg", image)[1].tobytes(),
            )
            self.say(frame, now_ns)

    def _move(self):
        if self.stopped is None and not self.fault:
            for name in self.cars:
                if name not in self.lost:
                    self.cars[name] = (self.cars[name] + 0.0125) % self.path.length_m

    def _slow(self, now_ns):
        self.say(self.monitor(now_ns), now_ns)
        details = {"world": f"{len(self.cars)} cars", "traffic": f"plan {self.plan}"}
        for name in (*PARTS, *(n for n in self.cars if n in KINDS and n not in self.lost)):
            status = PartStatus(
                station=name,
                t_ns=now_ns,
                detail=details.get(name, ""),
                step_ms=1.2,
                late_steps=3 if name == "eye" else 0,
            )
            self.say(status, now_ns)
        for number, (name, s) in enumerate(self.cars.items()):
            trip = Trip(
                vehicle=name,
                trip_id=f"t{number}",
                t_ns=now_ns,
                route=("west_loop", "crossing_south_east"),
                done_m=s,
                length_m=None if number % 2 else self.path.length_m,
                started_ns=now_ns,
                waiting_for=("signal", None, "vehicle")[number % 3],
            )
            self.say(trip, now_ns)

    def _steering(self, s):
        return math.atan(0.14154 * float(self.path.curvature(s)))

    def snapshot(self, now_ns):
        rows = []
        for number, (name, s) in enumerate(self.cars.items()):
            pose, alive = self.path.at(s), name not in self.lost
            moving = alive and self.stopped is None and not self.fault
            steering = self._steering(s)
            told = self.switches.get(name, OFF)
            turn = "left" if steering > 0.2 else "off"
            throttle, speed = (0.5, 0.25) if moving else (0.0, 0.0)
            lights = lamps(told, throttle, speed, now_ns, turn=turn)
            kind = KINDS.get(name, "hosted")
            row = SnapshotVehicle(
                vehicle=name,
                kind=kind,
                car=self.files.get(name, "nigel"),
                tag_id=number + 1,
                x_m=pose.x,
                y_m=pose.y,
                yaw_rad=pose.yaw,
                speed_mps=0.25 if moving else 0.0,
                steering_rad=steering,
                owner="world" if kind == "hosted" else name,
                mode="drive" if moving else "stop",
                age_ms=0.0 if kind == "hosted" else 14.0,
                alive=alive,
                throttle=0.5,
                lights=lights,
            )
            rows.append(row)
        return WorldSnapshot(
            t_ns=now_ns, tick=self.tick, vehicles=tuple(rows), real_time_factor=0.999
        )

    def spat(self, now_ns):
        junction = self.city_map.junctions[0]
        period_s = sum(duration for _, duration in CYCLE)
        flash = self.fault or self.plan == "flash"
        groups = []
        for number, group in enumerate(junction.groups):
            phase_s = (now_ns / NS_PER_S + number * period_s / 2.0) % period_s
            colour, left_s, following = _phase(phase_s)
            end_ns = now_ns + round(left_s * NS_PER_S)
            groups.append(
                SignalGroup(
                    group=group.name,
                    colour="flashing_red" if flash else colour,
                    since_ns=now_ns,
                    min_end_ns=end_ns,
                    max_end_ns=end_ns,
                    next_colour=None if flash else following,
                )
            )
        return Spat(
            junction=junction.name,
            t_ns=now_ns,
            seq=self.tick,
            mode="flash" if flash else "plan",
            plan=self.plan,
            groups=tuple(groups),
        )

    def monitor(self, now_ns):
        detail = "both groups green for 0.2 s" if self.fault else ""
        name = self.city_map.junctions[0].name
        return MonitorStatus(
            junction=name, t_ns=now_ns, fault=self.fault, detail=detail, since_ns=now_ns
        )

    def eye(self, now_ns):
        floor = self.city_map.floor
        width, height = 720, 380

        def pixel(x, y):
            right, down = (x - floor.x_m[0]) * PX_PER_M + 14, (floor.y_m[1] - y) * PX_PER_M + 14
            return float(right), float(down)

        image = np.full((height, width, 3), (98, 94, 90), np.uint8)
        track = [pixel(*self.path.at(s)[:2]) for s in np.arange(0.0, self.path.length_m, 0.03)]
        cv2.polylines(image, [np.int32(track)], True, (60, 58, 56), 56, cv2.LINE_AA)
        cv2.polylines(image, [np.int32(track)], True, (230, 230, 230), 1, cv2.LINE_AA)
        tags, poses = [self._tag(0, pixel, 0.0, 0.0, 0.0)], []
        for number, (name, s) in enumerate(self.cars.items()):
            pose = self.path.at(s)
            corners = [
                pixel(*pose.apply(x, y))
                for x, y in ((-0.07, -0.08), (0.23, -0.08), (0.23, 0.08), (-0.07, 0.08))
            ]
            cv2.fillPoly(image, [np.int32(corners)], (46, 40, 36), cv2.LINE_AA)
            tags.append(self._tag(number + 1, pixel, *pose.apply(0.035, 0.0), pose.yaw))
            x, y = self.rng.normal(0.0, 0.002, 2) + pose[:2]
            poses.append(
                EyePose(
                    camera="overhead",
                    vehicle=name,
                    tag_id=number + 1,
                    t_ns=now_ns,
                    x_m=x,
                    y_m=y,
                    yaw_rad=pose.yaw + self.rng.normal(0.0, 0.01),
                    covariance=(4e-6, 0.0, 0.0, 0.0, 4e-6, 0.0, 0.0, 0.0, 1e-4),
                )
            )
        for tag in tags:
            cv2.fillPoly(image, [np.int32(tag.corners_px)], (235, 235, 235), cv2.LINE_AA)
        image = cv2.add(image, self.rng.integers(0, 14, image.shape, dtype=np.uint8))
        jpeg = cv2.imencode(".jpg", image)[1].tobytes()
        frame = EyeFrame(
            camera="overhead", t_ns=now_ns, width_px=width, height_px=height, payload=jpeg
        )
        return [
            frame,
            EyeTags(camera="overhead", t_ns=now_ns, tags=tuple(tags), latency_ms=21.4),
            *poses,
        ]

    def _tag(self, tag_id, pixel, x, y, yaw):
        c, s = 0.038 * math.cos(yaw), 0.038 * math.sin(yaw)
        corners = [(-c + s, -s - c), (c + s, s - c), (c - s, s + c), (-c - s, -s + c)]
        return TagSeen(
            tag_id=tag_id,
            centre_px=pixel(x, y),
            corners_px=tuple(pixel(x + dx, y + dy) for dx, dy in corners),
            margin=60.0,
        )


def _phase(phase_s):
    for number, (colour, duration_s) in enumerate(CYCLE):
        if phase_s < duration_s:
            return colour, duration_s - phase_s, CYCLE[(number + 1) % len(CYCLE)][0]
        phase_s -= duration_s
    raise AssertionError(phase_s)


class ServedCity:
    """The demo city behind a real server on a free port."""

    def __init__(self, keys=None, port=0):
        self.view = CityView()
        self.city = DemoCity(self.view)
        app = create_app(
            self.view,
            self.city.ask,
            self.city.city_map,
            keys=keys,
            plans={"crossing": ("calm", "busy")},
        )
        self.url = ""
        self._ready, self._stop = threading.Event(), threading.Event()
        args = (app, "127.0.0.1", port, self._stop)
        self._thread = threading.Thread(
            target=serve, args=args, kwargs={"on_ready": self._note}, daemon=True
        )

    def _note(self, url):
        self.url = url
        self._ready.set()

    def __enter__(self):
        self.city.__enter__()
        self._thread.start()
        assert self._ready.wait(20.0), "the server did not start"
        return self

    def __exit__(self, *exc):
        self._stop.set()
        self._thread.join(5.0)
        self.city.__exit__()
        assert not self._thread.is_alive(), "the server did not stop"


if __name__ == "__main__":
    with ServedCity(port=int(sys.argv[1]) if len(sys.argv) > 1 else 0) as served:
        print(served.url)
        threading.Event().wait(float(sys.argv[2]) if len(sys.argv) > 2 else 600.0)
