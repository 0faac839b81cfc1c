"""The eye of the city: a frame in; the tags in it, the poses and tracks of its cars out.

With the emulated camera the world's snapshot is rendered, and the Eye only uses the picture. Two
more things are read from the snapshot: which tag id belongs to which vehicle, and which car file a
vehicle has (and so where its tag is). A city with real cars knows these from a list, too; no pose
is ever read from it.

Each camera has a part of its own, which publishes what it sees. The part of the map's first camera
also subscribes to the others and publishes tracks from all of them. Another calibration is put in
force on request.
"""

import logging
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from scm.arrays import Floats
from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import EyeError
from scm.eye.calibration import Calibration
from scm.eye.calibration_state import (
    ActiveCalibration,
    CalibrationHistory,
    UnsureError,
    description,
    started,
)
from scm.eye.camera import CameraModel, camera_of
from scm.eye.camera_monitor import CameraMonitor
from scm.eye.detect import Settings
from scm.eye.extrinsics import ExtrinsicsEstimator
from scm.eye.find.causes import Causes
from scm.eye.find.finder import TagFinder
from scm.eye.messages import pose_message, sighting, sighting_of, track_message
from scm.eye.overlay import jpeg, preview
from scm.eye.pose import car_poses
from scm.eye.roof_sizes import RoofSizes, is_on_a_roof
from scm.eye.roofs import at_middle_row, expected_tags
from scm.eye.source import Frame, Listener, Source
from scm.eye.sources.synthetic import SyntheticSource
from scm.eye.station import eye_station
from scm.eye.track.perception import collective_perception
from scm.eye.track.sighting import ROOF_TAG_SIZE, Sighting
from scm.eye.track.tracks import Tracks
from scm.log import event
from scm.records.city_map import CityMap, MapTag
from scm.records.eye import TagSeen
from scm.runtime.part import IsWanted, Service, Subscription
from scm.scenery.bodies import NIGEL, CarBody, car_body
from scm.v2x.exchange import Answer, Incoming, Outgoing, PersistedState
from scm.v2x.key import is_name
from scm.v2x.message import Message, Refused
from scm.v2x.messages.calibration_request import CalibrationReply, CalibrationRequest
from scm.v2x.messages.city_event import CityEvent
from scm.v2x.messages.cpm import CpmTx
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.eye_pose import EyePose
from scm.v2x.messages.eye_preview import EyePreview
from scm.v2x.messages.eye_status import Complaint, EyeStatus
from scm.v2x.messages.eye_tags import EyeTags
from scm.v2x.messages.eye_track import EyeTrack
from scm.v2x.messages.world_snapshot import WorldSnapshot

LOGGER = logging.getLogger(__name__)
TRACKS_PERIOD_NS = NS_PER_S // 20
FRAME_PERIOD_NS = NS_PER_S // 5
STATUS_PERIOD_NS = NS_PER_S // 2
CPM_PERIOD_NS = NS_PER_S // 5
EARLY_NS, AWAIT_NS = 4 * NS_PER_MS, 2 * NS_PER_MS
LOST_PERIODS, LOST_NS = 3, 20 * NS_PER_MS
"""After this many periods without a frame, frames are polled less often."""
SOON_NS = 5 * NS_PER_MS
"""Time step for the image velocity of a tag."""
SOURCE = "source"


class EyePart:
    """One overhead camera.

    Attributes:
        period_ns: Until its next step; frames from outside are polled closely once they are due,
            so that a pose does not wait for the clock.

    Args:
        city_map: The city it looks at.
        camera: Name of one of the map's cameras; None: the first.
        seed: Of the sensor noise and the floor's texture.
        source: Where frames come from; None: the emulated camera.
        settings: Of the search for tags.
        lens: Replaces the map's lens.
        tags: Further tags on the floor, besides the map's own.
        restored: Calibrations put in force in an earlier run.

    Raises:
        EyeError: The map has no such camera, or it is invalid.
    """

    role = "part"

    def __init__(
        self,
        city_map: CityMap,
        camera: str | None = None,
        seed: int = 0,
        source: Source | None = None,
        settings: Settings | None = None,
        lens: Calibration | None = None,
        tags: Sequence[MapTag] = (),
        restored: CalibrationHistory | None = None,
    ) -> None:
        chosen = camera_of(city_map, camera)
        at_start = started(chosen, lens)
        model = at_start.model()
        self.camera = model.camera.name
        self._calibration = ActiveCalibration(at_start, restored)
        self._camera_ns = round(NS_PER_S / model.camera.rate_hz)
        self.period_ns = min(self._camera_ns, TRACKS_PERIOD_NS)
        self.monitor = CameraMonitor(
            ExtrinsicsEstimator(self._calibration.now.model(), (city_map.tag, *tags))
        )
        self.services = (Service(CalibrationRequest, {"camera": self.camera}),)
        self.tracks = Tracks([one.name for one in city_map.cameras])
        self.publishes_tracks = chosen is city_map.cameras[0]
        self.name = eye_station(self.camera, first=self.publishes_tracks)
        self._finder = TagFinder(settings)
        self._roof_sizes, self._causes = RoofSizes(), Causes()
        self._source = source or _emulated(city_map, model, seed)
        self._is_awaited = source is not None
        self._came_ns = 0
        self._light: WorldSnapshot | None = None
        self._is_wanted: IsWanted = _nobody
        self._due_ns: dict[type[Message], int] = {EyeFrame: 0, EyeStatus: 0, EyeTrack: 0, CpmTx: 0}
        self.subscriptions = (
            Subscription(WorldSnapshot),
            *(
                [Subscription(EyePose)]
                if self.publishes_tracks and len(city_map.cameras) > 1
                else []
            ),
            *(self._source.subscriptions if isinstance(self._source, Listener) else ()),
        )

    def step(self, now_ns: int, inbox: Sequence[Incoming]) -> list[Outgoing]:
        """Process the newest frame, if there is one; publish tracks and status."""
        out = self._lapsed(now_ns) if self._calibration.lapsed else []
        for item in inbox:
            if isinstance(item.message, CalibrationRequest):
                out += self._serve(item, item.message, now_ns)
            else:
                self._receive(item, now_ns)
        frame = self._source.read(now_ns, self._light)
        seen = [] if frame is None else self._look(frame, now_ns)
        out += seen
        if self.publishes_tracks and (self._is_due(EyeTrack, now_ns, TRACKS_PERIOD_NS) or seen):
            out += self._tracked(now_ns)
        if self._is_due(EyeStatus, now_ns, STATUS_PERIOD_NS):
            out.append(self._status(now_ns))
        if self._is_awaited:
            self.period_ns = self._pause_ns(now_ns, came=frame is not None)
        return out

    def attach(self, is_wanted: IsWanted) -> None:
        """Draw previews only while somebody subscribes."""
        self._is_wanted = is_wanted

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Release the camera."""
        del now_ns
        self._source.close()
        return []

    def _pause_ns(self, now_ns: int, *, came: bool) -> int:
        """Return the pause until a camera's next frame is nearly due, then a short one."""
        if came:
            self._came_ns = now_ns
        since_ns = now_ns - self._came_ns
        rest_ns = self._camera_ns - EARLY_NS - since_ns
        if rest_ns > AWAIT_NS:
            return min(rest_ns, TRACKS_PERIOD_NS)
        return AWAIT_NS if since_ns < LOST_PERIODS * self._camera_ns else LOST_NS

    def _receive(self, item: Incoming, now_ns: int) -> None:
        if isinstance(item.message, WorldSnapshot):
            self._light = item.message
        elif isinstance(item.message, EyePose):
            if item.message.camera != self.camera:
                self.tracks.see([sighting_of(item.message)], now_ns)
        elif isinstance(self._source, Listener):
            self._source.receive(item)

    def _serve(self, item: Incoming, request: CalibrationRequest, now_ns: int) -> list[Outgoing]:
        """Put a calibration in force from the next frame on, or refuse it."""
        try:
            self.monitor = self._calibration.serve(request, self.monitor, now_ns)
        except EyeError as refusal:
            code = "unsure" if isinstance(refusal, UnsureError) else "invalid"
            return [Answer(item, Refused(code=code, detail=str(refusal)))]
        self._due_ns[EyeStatus] = now_ns
        status = self._calibration.status()
        return [
            PersistedState("calibrations", self.camera, self._calibration.record),
            Answer(item, CalibrationReply(camera=self.camera, in_force=status)),
            self._event("calibration_in_force", description(self.camera, status), now_ns),
        ]

    def _lapsed(self, now_ns: int) -> list[Outgoing]:
        """Report once that the stored calibration is not in force, and delete it."""
        self._calibration.lapsed = False
        text = (
            f"camera {self.camera} uses the map file: the calibration put in force before is of "
            "another map file or lens"
        )
        forget = PersistedState("calibrations", self.camera, None)
        return [forget, self._event("calibration_lapsed", text, now_ns, "warning")]

    def _event(
        self, name: str, text: str, now_ns: int, severity: Literal["info", "warning"] = "info"
    ) -> CityEvent:
        return CityEvent(severity=severity, source=self.name, t_ns=now_ns, name=name, text=text)

    def _look(self, frame: Frame, now_ns: int) -> list[Outgoing]:
        grey, known = frame.grey(), self._known()
        bodies = dict(known.values())
        tags = self._finder.find(grey, self._expected(frame.t_ns, bodies))
        corners = {tag.tag_id: np.array(tag.corners_px) for tag in reversed(tags)}
        self.monitor.see(frame.t_ns, grey, corners)
        self._causes.see(frame.t_ns, grey, missing=self._misses_tags(corners, known))
        flags = self.monitor.flags(now_ns)
        sightings = [] if "frame_size" in flags else self._sightings(frame, tags, known, flags)
        self.tracks.see(sightings, now_ns)
        age_ms = self.monitor.estimator.age_ms(frame.t_ns)
        late_ms = (now_ns - frame.t_ns) / NS_PER_MS
        seen = EyeTags(camera=self.camera, t_ns=frame.t_ns, tags=tags, latency_ms=late_ms)
        return [seen, *(pose_message(one, age_ms) for one in sightings),
                *self._news(frame.t_ns, now_ns),
                *self._picture(frame, tags, known, now_ns)]  # fmt: skip

    def _expected(self, t_ns: int, bodies: dict[str, CarBody]) -> dict[int, Floats]:
        estimator = self.monitor.estimator
        ours = {tag.tag_id: estimator.expected(tag) for tag in estimator.map_tags}
        return {**expected_tags(estimator.model, self.tracks.at(t_ns), bodies), **ours}

    def _known(self) -> dict[int, tuple[str, CarBody]]:
        """Return the vehicles by tag id: the only facts used from the snapshot."""
        vehicles = self._light.vehicles if self._light else ()
        named = [car for car in vehicles if is_name(car.vehicle)]
        return {car.tag_id: (car.vehicle, car_body(car.car)) for car in named}

    def _sightings(
        self, frame: Frame, tags: Sequence[TagSeen], known: dict[int, tuple[str, CarBody]],
        flags: tuple[str, ...],
    ) -> list[Sighting]:  # fmt: skip
        ours = {tag.tag_id for tag in self.monitor.estimator.map_tags}
        cars = [tag for tag in tags if tag.tag_id not in ours]
        whose = [known.get(tag.tag_id, (f"tag-{tag.tag_id}", NIGEL)) for tag in cars]
        corners = np.array([tag.corners_px for tag in cars]).reshape(-1, 4, 2)
        corners = self._unrolled(frame.t_ns, [tag.tag_id for tag in cars], corners, dict(whose))
        found = car_poses(self.monitor.estimator, [body for _, body in whose], corners)
        sizes = [
            self._roof_sizes.see(frame.t_ns, tag.tag_id, *one, pose)
            for tag, one, pose in zip(cars, whose, found, strict=True)
        ]
        return [
            sighting(self.camera, frame.t_ns, tag.tag_id, vehicle, pose, (*flags, *more))
            for tag, (vehicle, _), pose, more in zip(cars, whose, found, sizes, strict=True)
            if is_on_a_roof(tag.tag_id, vehicle, pose)
        ]

    def _misses_tags(
        self, corners: Mapping[int, Floats], known: Mapping[int, tuple[str, CarBody]]
    ) -> bool:
        """Return whether no car's tag was found although cars are known, or no tag at all."""
        ours = {tag.tag_id for tag in self.monitor.estimator.map_tags}
        return corners.keys() <= ours and (bool(known) or not corners)

    def _news(self, t_ns: int, now_ns: int) -> list[Outgoing]:
        """Report once, as events and logs, wrong roof tag sizes and causes of missing tags."""
        height = float(self.monitor.estimator.model.position[2])
        sizes = [(ROOF_TAG_SIZE, text) for text in self._roof_sizes.news(t_ns, height)]
        found = [*sizes, *((one.code, one.said) for one in self._causes.news())]
        for name, text in found:
            event(LOGGER, name, level=logging.WARNING, camera=self.camera, said=repr(text))
        return [self._event(name, text, now_ns, "warning") for name, text in found]

    def _unrolled(
        self, t_ns: int, ids: Sequence[int], corners: Floats, bodies: dict[str, CarBody]
    ) -> Floats:
        """Return corners, (n, 4, 2) [px], corrected for the rolling shutter."""
        model = self.monitor.estimator.model
        if not model.camera.rolling_s:
            return corners
        now, later = (
            expected_tags(model, self.tracks.at(at), bodies) for at in (t_ns, t_ns + SOON_NS)
        )
        return np.array([
            at_middle_row(found, (later[tag_id] - now[tag_id]) * (NS_PER_S / SOON_NS), model.camera)
            if tag_id in now and tag_id in later else found
            for tag_id, found in zip(ids, corners, strict=True)
        ]).reshape(-1, 4, 2)  # fmt: skip

    def _tracked(self, now_ns: int) -> list[Outgoing]:
        tracks = self.tracks.at(now_ns)
        messages: list[Outgoing] = [track_message(track) for track in tracks]
        if tracks and self._is_due(CpmTx, now_ns, CPM_PERIOD_NS):
            messages.append(collective_perception(tracks, self.name, now_ns))
        return messages

    def _status(self, now_ns: int) -> EyeStatus:
        problem, spoiled = self._source.problem, self.monitor.flags(now_ns)
        complaints = self._complaints(now_ns)
        if problem:
            complaints = (*complaints, Complaint(code=SOURCE, said=problem))
        good = not problem and not spoiled
        return EyeStatus(
            camera=self.camera,
            t_ns=now_ns,
            good=good,
            complaints=complaints,
            in_force=self._calibration.status(),
        )

    def _complaints(self, now_ns: int) -> tuple[Complaint, ...]:
        """Return what is wrong with the camera, and with roof tags that it sees."""
        height = float(self.monitor.estimator.model.position[2])
        sizes = self._roof_sizes.complaints(now_ns, height)
        return (*self.monitor.complaints(now_ns), *self._causes.complaints(), *sizes)

    def _picture(
        self, frame: Frame, tags: Sequence[TagSeen], known: dict[int, tuple[str, CarBody]],
        now_ns: int,
    ) -> list[EyeFrame | EyePreview]:  # fmt: skip
        if not self._is_due(EyeFrame, frame.t_ns, FRAME_PERIOD_NS):
            return []
        height, width = frame.image.shape[:2]
        size = {"camera": self.camera, "t_ns": frame.t_ns, "width_px": width, "height_px": height}
        messages: list[EyeFrame | EyePreview] = [EyeFrame(payload=jpeg(frame.image), **size)]
        if self._is_wanted(EyePreview, {"camera": self.camera}):
            names = {tag_id: vehicle for tag_id, (vehicle, _) in known.items()}
            names |= {tag.tag_id: f"map {tag.tag_id}" for tag in self.monitor.estimator.map_tags}
            wrong = [one.said for one in self._complaints(now_ns)]
            messages.append(EyePreview(payload=preview(frame.image, tags, names, wrong), **size))
        return messages

    def _is_due(self, kind: type[Message], now_ns: int, period_ns: int) -> bool:
        """Return whether a message is due, once a period, at most half a step early."""
        if now_ns < self._due_ns[kind] - min(self._camera_ns, TRACKS_PERIOD_NS) // 2:
            return False
        self._due_ns[kind] = now_ns + period_ns
        return True


def _nobody(kind: type[Message], where: Mapping[str, str]) -> bool:
    """Return False: a bus without matching subscribers."""
    del kind, where
    return False


def _emulated(city_map: CityMap, model: CameraModel, seed: int) -> SyntheticSource:
    return SyntheticSource(city_map, model, np.random.default_rng([seed, *b"eye"]))
