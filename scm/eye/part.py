"""The eye of the city: a frame in, the tags in it and the poses of its cars out.

With the emulated camera the world's snapshot is the light: it is rendered and then only looked at.
Two things are taken from the snapshot besides: which tag id belongs to which vehicle, and which car
file a vehicle is (so where its tag sits). A city with real cars only knows these from a list, too;
no pose is ever read from it.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from scm.arrays import Image
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import EyeError, nearest
from scm.eye.anchor import Anchor
from scm.eye.camera import CameraModel, camera_model
from scm.eye.detect import Settings, detect_tags
from scm.eye.pose import car_pose
from scm.eye.source import Frame, Source
from scm.eye.sources.synthetic import SyntheticSource
from scm.maps.model import Camera, CityMap
from scm.part import Hears
from scm.scenery.bodies import NIGEL, CarBody, car_body
from scm.v2x.exchange import Incoming, Outgoing
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_tags import EyeTags, TagSeen
from scm.v2x.messages.world_snapshot import WorldSnapshot

FRAME_PERIOD_NS = NS_PER_S // 5
JPEG_QUALITY = 80


class EyePart:
    """One overhead camera.

    Args:
        city_map: The city it looks at.
        camera: Name of one of the map's cameras; None: the first.
        seed: Of the sensor's noise and the floor's grain.
        source: Where frames come from; None: the emulated camera.
        settings: Of the detector.

    Raises:
        EyeError: The map has no such camera, or it cannot be one.
    """

    name = "eye"
    role = "part"
    hears = (Hears(WorldSnapshot),)
    serves = ()

    def __init__(
        self,
        city_map: CityMap,
        camera: str | None = None,
        seed: int = 0,
        source: Source | None = None,
        settings: Settings | None = None,
    ) -> None:
        model = camera_model(_choose(city_map, camera))
        self.camera = model.camera.name
        self.period_ns = round(NS_PER_S / model.camera.rate_hz)
        self.anchor = Anchor(model, city_map.tag)
        self._settings = settings or Settings()
        self._source = source or _emulated(city_map, model, seed)
        self._light: WorldSnapshot | None = None
        self._pictured_ns: int | None = None

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Take the newest frame, if there is one, and say what is in it."""
        for item in inbox:
            if isinstance(item.message, WorldSnapshot):
                self._light = item.message
        frame = self._source.take(now_ns, self._light)
        if frame is None:
            return []
        self._check_size(frame)
        tags = detect_tags(frame.grey(), self._settings)
        latency_ms = (now_ns - frame.t_ns) / NS_PER_MS
        seen = EyeTags(camera=self.camera, t_ns=frame.t_ns, tags=tags, latency_ms=latency_ms)
        return [seen, *self._poses(frame.t_ns, tags), *self._picture(frame)]

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Leave without a word."""
        del now_ns
        return []

    def _check_size(self, frame: Frame) -> None:
        """Refuse pictures that the camera of the map cannot have taken."""
        camera = self.anchor.model.camera
        got = (frame.image.shape[1], frame.image.shape[0])
        if got != (camera.width_px, camera.height_px):
            wanted = f"{camera.width_px} x {camera.height_px}"
            msg = (
                f"camera {camera.name!r}: got a frame of {got[0]} x {got[1]} px, expected {wanted}"
            )
            raise EyeError(msg)

    def _poses(self, t_ns: int, tags: tuple[TagSeen, ...]) -> list[EyePose]:
        map_tag = self.anchor.tag.tag_id
        ours = next((np.array(tag.corners_px) for tag in tags if tag.tag_id == map_tag), None)
        self.anchor.see(ours, t_ns)
        known = self._known()
        poses = []
        for tag in tags:
            if tag.tag_id != map_tag:
                vehicle, body = known.get(tag.tag_id, (f"tag-{tag.tag_id}", NIGEL))
                poses.append(self._pose(t_ns, vehicle, body, tag))
        return poses

    def _known(self) -> dict[int, tuple[str, CarBody]]:
        """Return whose tag is whose: the only facts taken from the snapshot."""
        vehicles = self._light.vehicles if self._light else ()
        return {car.tag_id: (car.vehicle, car_body(car.car)) for car in vehicles}

    def _pose(self, t_ns: int, vehicle: str, body: CarBody, tag: TagSeen) -> EyePose:
        estimate = car_pose(self.anchor, body, np.array(tag.corners_px))
        a, b, c, d, e, f, g, h, i = (float(value) for value in estimate.covariance.flat)
        return EyePose(
            camera=self.camera,
            vehicle=vehicle,
            tag_id=tag.tag_id,
            t_ns=t_ns,
            x_m=estimate.pose.x,
            y_m=estimate.pose.y,
            yaw_rad=estimate.pose.yaw,
            covariance=(a, b, c, d, e, f, g, h, i),
            map_tag_age_ms=self.anchor.age_ms(t_ns),
        )

    def _picture(self, frame: Frame) -> list[EyeFrame]:
        early_ns = self.period_ns // 2
        last_ns = self._pictured_ns
        if last_ns is not None and frame.t_ns - last_ns < FRAME_PERIOD_NS - early_ns:
            return []
        self._pictured_ns = frame.t_ns
        height, width = frame.image.shape[:2]
        picture = EyeFrame(
            camera=self.camera,
            t_ns=frame.t_ns,
            width_px=width,
            height_px=height,
            payload=_jpeg(frame.image),
        )
        return [picture]


def _choose(city_map: CityMap, camera: str | None) -> Camera:
    names = [one.name for one in city_map.cameras]
    if not names:
        raise EyeError(f"map {city_map.name}: [[cameras]]: expected at least one for the eye")
    if camera is None:
        return city_map.cameras[0]
    if camera not in names:
        raise EyeError(
            f"map {city_map.name}: no camera {camera!r}, expected one of {', '.join(names)}"
            f"{nearest(camera, names)}"
        )
    return city_map.cameras[names.index(camera)]


def _emulated(city_map: CityMap, model: CameraModel, seed: int) -> SyntheticSource:
    return SyntheticSource(city_map, model, np.random.default_rng([seed, *b"eye"]))


def _jpeg(image: Image) -> bytes:
    good, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not good:
        raise EyeError(f"cannot encode a frame of shape {image.shape} as JPEG")
    return data.tobytes()
