"""A script's packet: every key of the simulator's, in every packet, as strings.

    V1 Throttle                  command to the motors, -1 to 1
    V1 Steering                  mean angle of the front wheels [rad], + = left
    V1 Speed                     along the car [m/s], + = forward
    V1 Encoder Ticks, Angles     "left right", counts and wheel angle [rad]
    V1 Position                  "x y z" of the rear axle's centre [m], map frame
    V1 Orientation ...           of the IMU: "x y z w", and "roll pitch yaw" in [0, 2 pi) [rad]
    V1 Angular Velocity          of the IMU [rad/s]
    V1 Linear Acceleration       of the IMU without gravity [m/s^2]
    V1 LIDAR ...                 rate [Hz]; 360 ranges [m] from straight ahead, counter-clockwise; a
                                 scanner of part of a circle: its own beams, from the right
    V1 Front, Rear Camera Image  JPEG in base64; a black one where none comes
    TL1 State                    0 off, 1 red, 2 yellow, 3 green

Of the simulator's versions 0.1 has keys without `V1` and no lights; the newest compresses the
ranges: one a line, gzip, base64.

Position is the rear axle's, not the roof's: in a log of the simulator the course fits a point
0.002 m ahead of the axle, at the height of a wheel's radius; the roof's tag is 0.035 m ahead.
Only the newest of each message is stored; unchanged pieces are not written again.
"""

import base64
import gzip
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np

from scm.camera.optics import cameras_of
from scm.clock import NS_PER_MS
from scm.v2x.message import Message
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.vehicles.autodrive_senses import BEAMS, ranges_of, without_gravity
from scm.vehicles.car import Car
from vehicle_agent.devkit.deflate import Packet, Piece
from vehicle_agent.devkit.engineio import EVENT

INTENSITY = 47.0
Version = Literal["0.1", "0.3", "newest"]
"""Version of the simulator."""

FLASH_NS = 500 * NS_PER_MS
CAMERAS = {"front": "Front Camera Image", "rear": "Rear Camera Image"}
_BLACK_PX = (1280, 720)
_INTENSITY_TEXT = f"{INTENSITY:.4f}"
_COLOURS = {"red": 1, "yellow": 2, "green": 3, "dark": 0}


@dataclass(slots=True)
class _Cached:
    """The newest message of a kind, and its piece of the packet."""

    message: Message | None = None
    written: Message | None = None
    piece: Piece = field(default_factory=Piece)


class CarTelemetry:
    """One car's share of the packet.

    Args:
        prefix: `V1 `.
        car: Its car file.
        is_packed: Whether ranges are compressed.
    """

    def __init__(self, prefix: str, car: Car, *, is_packed: bool = False) -> None:
        self._prefix, self._is_packed = prefix, is_packed
        self._car, self._fitted = car, cameras_of(car)
        self._turn = 2.0 * math.pi / _number(car, "encoder.counts_per_revolution", 1920.0)
        self._radius_m = _number(car, "wheel.radius_m", 0.0325)
        self._rate_hz = _number(car, "lidar.rate_hz", 7.0)
        view_rad = _number(car, "lidar.field_of_view_rad", math.tau)
        beams = round(_number(car, "lidar.beams", BEAMS))
        self._nothing = ["inf"] * (beams if _is_part(view_rad, beams) else BEAMS)
        self._own, self._scan = _Cached(), _Cached()
        self._cameras = {camera: _Cached() for camera in CAMERAS}
        self._state: VehicleState | None = None
        self._sensors: VehicleSensors | None = None

    def forget_views(self) -> None:
        """Discard the scan and the pictures: they are no longer updated."""
        self._scan = _Cached()
        self._cameras = {camera: _Cached() for camera in CAMERAS}

    def unpictured(self, cameras: Sequence[str]) -> list[str]:
        """Return those of some cameras that the car has and that sent no picture yet."""
        own = (camera for camera in self._fitted if camera in cameras)
        return [camera for camera in own if self._cameras[camera].message is None]

    def update(self, message: Message) -> None:
        """Store a message about the car; from any one thread."""
        if isinstance(message, VehicleState):
            self._state = self._own.message = message
        elif isinstance(message, VehicleSensors):
            self._sensors = self._own.message = message
        elif isinstance(message, LidarScan):
            self._scan.message = message
        elif isinstance(message, CameraFrame) and message.camera in self._cameras:
            self._cameras[message.camera].message = message

    def pieces(self) -> list[Piece]:
        """Return its keys and values as pieces of JSON; from any one thread."""
        state, sensors = self._state, self._sensors
        own, scan = self._own, self._scan
        newest = own.message
        if state is not None and newest is not own.written:
            own.piece, own.written = self._own_piece(state, sensors), newest
        newest = scan.message
        if not scan.piece.text or newest is not scan.written:
            scan.piece, scan.written = self._scan_piece(newest), newest
        out = [own.piece, scan.piece]
        for camera, cached in self._cameras.items():
            newest = cached.message
            if not cached.piece.text or newest is not cached.written:
                cached.piece, cached.written = self._picture_piece(camera, newest), newest
            out.append(cached.piece)
        return out

    def _pairs(self, values: Mapping[str, str], is_picture: bool = False) -> Piece:
        pairs = (f'"{self._prefix}{key}":"{value}"' for key, value in values.items())
        return Piece(",".join(pairs), is_picture)

    def _own_piece(self, state: VehicleState, sensors: VehicleSensors | None) -> Piece:
        throttle, steering, ticks = state.throttle, state.steering_rad, (0, 0)
        rpy, rates, accel = (0.0, 0.0, state.yaw_rad), (0.0, 0.0, state.yaw_rate_radps), None
        if sensors is not None:
            throttle = throttle if sensors.throttle is None else sensors.throttle
            steering = steering if sensors.steering_rad is None else sensors.steering_rad
            ticks, rates = (sensors.encoder_left, sensors.encoder_right), sensors.gyro_radps
            rpy, accel = sensors.orientation_rad or rpy, sensors.accel_mps2
        moved = (state.accel_mps2, 0.0, 0.0) if accel is None else without_gravity(accel, rpy)
        return self._pairs(
            {
                "Throttle": _text(throttle),
                "Steering": _text(steering),
                "Speed": _text(state.speed_mps),
                "Encoder Ticks": f"{ticks[0]} {ticks[1]}",
                "Encoder Angles": _text(*(tick * self._turn for tick in ticks)),
                "Position": _text(state.x_m, state.y_m, self._radius_m),
                "Orientation Quaternion": _text(*quaternion(rpy)),
                "Orientation Euler Angles": _text(*(angle % (2.0 * math.pi) for angle in rpy)),
                "Angular Velocity": _text(*rates),
                "Linear Acceleration": _text(*moved),
            }
        )

    def _scan_piece(self, scan: Message | None) -> Piece:
        texts = _range_texts(scan) if isinstance(scan, LidarScan) else self._nothing
        ranges = " ".join(texts)
        return self._pairs(
            {
                "LIDAR Scan Rate": _text(self._rate_hz),
                "LIDAR Range Array": gzipped(ranges) if self._is_packed else ranges,
                "LIDAR Intensity Array": " ".join([_INTENSITY_TEXT] * len(texts)),
            }
        )

    def _picture_piece(self, camera: str, frame: Message | None) -> Piece:
        if isinstance(frame, CameraFrame):
            jpeg = frame.payload
        else:
            has = self._car.has("camera.resolution_px")
            size = self._car.vector("camera.resolution_px") if has else _BLACK_PX
            jpeg = black_jpeg(round(size[0]), round(size[1]))
        return self._pairs({CAMERAS[camera]: base64.b64encode(jpeg).decode()}, is_picture=True)


class Telemetry:
    """The packet of several cars and lights.

    Args:
        names: Of the vehicles, in the order of V1, V2...
        version: Of the packet.
    """

    def __init__(self, names: Sequence[str], version: Version = "0.3") -> None:
        self._names, self._version = tuple(names), version
        self._cars: dict[str, CarTelemetry] = {}
        self._files: dict[str, str] = {}
        self._heads: Sequence[tuple[str, str]] | None = None
        self._spats: dict[str, Spat] = {}
        self._lights = Piece()

    def knows(self, vehicle: str, car_file: str) -> bool:
        """Return whether a car was added already, with this car file."""
        return self._files.get(vehicle) == car_file

    def add_car(self, vehicle: str, car_file: str, car: Car) -> None:
        """Add a car; its messages follow."""
        self._files[vehicle] = car_file
        prefix = "" if self._version == "0.1" else f"V{self._names.index(vehicle) + 1} "
        is_packed = self._version == "newest"
        self._cars[vehicle] = CarTelemetry(prefix, car, is_packed=is_packed)

    def show_lights(self, heads: Sequence[tuple[str, str]]) -> None:
        """Set the lights, by junction and group, as TL1, TL2..."""
        self._heads = tuple(heads)

    def forget_views(self) -> None:
        """Discard the scans and the pictures of all cars."""
        for car in self._cars.values():
            car.forget_views()

    def update(self, message: Message) -> None:
        """Store a message of the city; unrelated ones are ignored."""
        if isinstance(message, Spat):
            if any(junction == message.junction for junction, _ in self._heads or ()):
                self._spats[message.junction] = message
            return
        car = self._cars.get(str(getattr(message, "vehicle", "")))
        if car is not None:
            car.update(message)

    def unpictured(self, cameras: Sequence[str]) -> list[str]:
        """Return "n1 front" and so on: those of some cameras that sent no picture yet."""
        return [
            f"{name} {camera}"
            for name in self._names
            if name in self._cars
            for camera in self._cars[name].unpictured(cameras)
        ]

    @property
    def unknown(self) -> list[str]:
        """The cars that were not added yet."""
        return [name for name in self._names if name not in self._cars]

    def packet(self) -> Packet | None:
        """Return the packet; None until all cars and the lights are known."""
        if self.unknown or self._heads is None:
            return None
        pieces = [piece for name in self._names for piece in self._cars[name].pieces()]
        if self._heads and self._version != "0.1":
            pieces.append(self._lights_piece(self._heads))
        return Packet(EVENT, pieces)

    def _lights_piece(self, heads: Sequence[tuple[str, str]]) -> Piece:
        """Return the lights' piece; it is reused while they show the same."""
        shown = enumerate((self._shown(*head) for head in heads), 1)
        text = ",".join(f'"TL{number} State":"{colour}"' for number, colour in shown)
        if text != self._lights.text:
            self._lights = Piece(text)
        return self._lights

    def _shown(self, junction: str, group: str) -> int:
        spat = self._spats.get(junction)
        if spat is None:
            return 0
        colour = next((one.colour for one in spat.groups if one.group == group), "dark")
        if colour == "flashing_red":
            return 1 if spat.t_ns // FLASH_NS % 2 == 0 else 0
        return _COLOURS[colour]


def _number(car: Car, key: str, otherwise: float) -> float:
    return car.value(key) if car.has(key) else otherwise


def _text(*numbers: float) -> str:
    """Return numbers with four decimals, separated by spaces; NaN as 0."""
    return " ".join(f"{number if math.isfinite(number) else 0.0:.4f}" for number in numbers)


def _is_part(view_rad: float, beams: int) -> bool:
    """Return whether beams leave a gap of more than one of them in the circle."""
    return beams > 0 and view_rad + view_rad / beams < math.tau


def _range_texts(scan: LidarScan) -> list[str]:
    """Return the ranges as text; "inf" is none."""
    step_rad = scan.bearing_step_rad
    if step_rad is not None and _is_part(abs(step_rad) * (scan.beams - 1), scan.beams):
        payload = scan.payload[: len(scan.payload) // 4 * 4]
        ranges = np.frombuffer(payload, "<f4")[: scan.beams][:: 1 if step_rad > 0.0 else -1]
    else:
        ranges = ranges_of(scan)
    return [f"{one:.4f}" if math.isfinite(one) else "inf" for one in ranges.tolist()]


def gzipped(ranges: str) -> str:
    """Return ranges as the newest simulator compresses them."""
    lines = ranges.replace(" ", "\n").encode()
    return base64.b64encode(gzip.compress(lines, compresslevel=1, mtime=0)).decode()


def quaternion(rpy: tuple[float, float, float]) -> tuple[float, float, float, float]:
    """Return x, y, z, w of roll, pitch and yaw [rad], turned about z, y, x in this order."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2.0), math.cos(a / 2.0)) for a in rpy)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


@lru_cache(maxsize=8)
def black_jpeg(width_px: int, height_px: int) -> bytes:
    """Return a black colour picture as a full-size JPEG, for scripts that crop it.

    Progressive and with optimised codes it has 6 kB instead of 15: a script's server unmasks each
    byte in Python.
    """
    black = np.zeros((height_px, width_px, 3), np.uint8)
    small = [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    _, data = cv2.imencode(".jpg", black, small)
    return data.tobytes()
