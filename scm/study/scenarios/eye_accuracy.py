"""A film of driving cars, whose truth is known, is shown to AutoDRIVE Eye: how right is it?

The map's first camera hangs so that it looks at the middle of the floor, tilted as the map says,
with a lens that shows the whole floor. Everything that `scm eye` does is done but the bus, with a
camera that the map knows as well as a tape measure and a level do. Nothing stands on the floor.
"""

import math

import numpy as np
from msgspec.structs import replace

from scm.arrays import Floats
from scm.clock import NS_PER_S
from scm.eye.camera import CameraModel
from scm.eye.extrinsics import Tolerance
from scm.eye.part import EyePart
from scm.eye.render.scene import camera_over
from scm.eye.render.shots import Look, Shot, Studio
from scm.eye.render.traffic import tours
from scm.eye.source import Frame
from scm.records.city_map import Camera, CityMap
from scm.study.case import Case
from scm.v2x.exchange import Incoming
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.world_snapshot import WorldSnapshot

MAP = "driving_school"
CARS, SPEED_MPS, RATE_HZ = 10, 0.26, 30.0
FRAMES, WARM_UP_FRAMES = 15, 3
EXPOSURE_S = 0.004


def run(case: Case, blur_px: float = 0.0, defocus_px: float = 0.7) -> dict[str, float]:
    """Return the errors of the poses in single frames, and how many tags were found.

    Args:
        case: The case.
        blur_px: Motion blur of the whole picture, as of a shaking camera, in a random direction.
        defocus_px: Radius of the blur disc of a lens out of focus.
    """
    city_map = replace(case.map, walls=(), boxes=(), lights=())
    look = Look(
        exposure_s=EXPOSURE_S, blur_px=blur_px, defocus_px=defocus_px, colour=False,
        blur_rad=case.generator("blur").uniform(0.0, math.pi),
        noise_sigma=case.map.cameras[0].noise_sigma,
    )  # fmt: skip
    shots = _film(case, city_map, look)
    errors, count = _errors(city_map, shots, _as_measured(case, shots[0].camera))
    known = len(errors) > 0
    return {
        "position_rmse_m": math.sqrt(np.mean(errors[:, 0] ** 2)) if known else math.nan,
        "heading_rmse_rad": math.sqrt(np.mean(errors[:, 1] ** 2)) if known else math.nan,
        "found_share": len(errors) / count,
    }


def _film(case: Case, city_map: CityMap, look: Look) -> list[Shot]:
    """Return shots of cars that drive around the floor."""
    camera = city_map.cameras[0]
    size = camera.width_px, camera.height_px
    model = camera_over(city_map, size, camera.z_m, camera.tilt_x_rad)
    duration_s, rng = FRAMES / RATE_HZ, case.generator("cars")
    cars = tours(city_map, CARS, SPEED_MPS, duration_s, rng, on_lanes=False)
    studio = Studio(city_map, model, look, case.seed)
    times = [frame / RATE_HZ for frame in range(FRAMES)]
    return [studio.shoot([car.at(t) for car in cars], round(t * NS_PER_S)) for t in times]


def _as_measured(case: Case, model: CameraModel) -> Camera:
    """Return a camera as the map has it: off by what a calibration's tolerance allows."""
    off = Tolerance().deviations() * case.generator("calibration").standard_normal(6)
    noise = case.map.cameras[0].noise_sigma
    moved = model.moved_to(model.extrinsics + off).camera
    return replace(moved, rate_hz=RATE_HZ, noise_sigma=noise)


def _errors(city_map: CityMap, shots: list[Shot], camera: Camera) -> tuple[Floats, int]:
    """Return the errors of all poses, (n, 2) [m, rad], and how many there should be."""
    eye = EyePart(replace(city_map, cameras=(camera,)), source=_Film(shots))
    errors, count = list[tuple[float, float]](), 0
    for tick, shot in enumerate(shots):
        truth = {one.car.vehicle: one.car for one in shot.cars}
        snapshot = WorldSnapshot(t_ns=shot.t_ns, tick=tick, vehicles=tuple(truth.values()))
        sent = eye.step(shot.t_ns, [Incoming(snapshot, shot.t_ns)])
        if tick < WARM_UP_FRAMES:
            continue
        count += len(truth)
        for message in sent:
            if isinstance(message, EyePose):
                true = truth[message.vehicle]
                away = math.hypot(message.x_m - true.x_m, message.y_m - true.y_m)
                errors.append((away, math.remainder(message.yaw_rad - true.yaw_rad, math.tau)))
    return np.array(errors).reshape(-1, 2), count


class _Film:
    """A source of frames: shots, one after the other."""

    problem: str | None = None

    def __init__(self, shots: list[Shot]) -> None:
        self._left = iter(shots)

    def read(self, now_ns: int, light: WorldSnapshot | None) -> Frame | None:
        """Return the next frame."""
        del now_ns, light
        shot = next(self._left, None)
        return None if shot is None else Frame(shot.t_ns, shot.image)

    def close(self) -> None:
        """Nothing to release."""
