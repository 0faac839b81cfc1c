"""The recorder: a part that subscribes to everything and publishes only its status."""

from collections.abc import Sequence
from pathlib import Path

from scm.clock import NS_PER_MS, NS_PER_S
from scm.errors import RecordingError
from scm.recorder.mcap_file import RunFile
from scm.runtime.part import BasePart, Subscription
from scm.v2x.exchange import Incoming, Outgoing, RawSample
from scm.v2x.key import check_name
from scm.v2x.message import Delivery, Message
from scm.v2x.messages import message_classes
from scm.v2x.messages.cam import CamRx, CamTx
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.costmap import Costmap
from scm.v2x.messages.cpm import CpmRx
from scm.v2x.messages.denm import DenmRx, DenmTx
from scm.v2x.messages.eye_frame import EyeFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.mapem import MapemRx
from scm.v2x.messages.part_status import PartStatus
from scm.v2x.messages.spatem import SpatemRx
from scm.v2x.messages.srem import SremRx, SremTx
from scm.v2x.messages.ssem import SsemRx
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState

FLUSH_NS = 250 * NS_PER_MS
FRAMES_HZ = 1.0
OF_EACH_CAR = (
    *(VehicleState, VehicleSensors, LidarScan, CameraFrame, Costmap),
    *(CamTx, DenmTx, SremTx),
    *(CamRx, CpmRx, DenmRx, MapemRx, SpatemRx, SremRx, SsemRx),
)


class RecorderPart(BasePart):
    """Writes every message of the city; a kill loses at most the last half second.

    The Eye's pictures would be nearly all of the file (some 30 MB a minute at 5 Hz), so at most
    `frames_hz` a second of each of its cameras are stored; 0 stores none. The cars' own cameras run
    only for subscribers: `cameras_hz` above 0 subscribes to those of all cars or of the cars in
    `cameras_of`, and stores that many a second of each.

    In a large city the cars' own messages would be nearly all of it. A `sparse` recording leaves
    out their states, sensors and radio frames, and unknown keys, so the city need not make them;
    the snapshots have all cars.
    """

    name = "record"
    role = "part"
    period_ns = 50 * NS_PER_MS

    def __init__(
        self,
        path: Path,
        city: str = "city",
        frames_hz: float = FRAMES_HZ,
        cameras_hz: float = 0.0,
        cameras_of: Sequence[str] = (),
        *,
        sparse: bool = False,
    ) -> None:
        if cameras_of and not cameras_hz:
            msg = f"cameras_hz: got {cameras_hz}, expected more than 0 with --cameras-of"
            raise RecordingError(msg)
        self._period_ns = {
            EyeFrame: _period_ns("frames_hz", frames_hz),
            CameraFrame: _period_ns("cameras_hz", cameras_hz),
        }
        kinds = _without_cars() if sparse else (Message,)
        self.subscriptions = (
            *(Subscription(kind, raw=True) for kind in kinds),
            *(_cameras(cameras_of) if cameras_hz else ()),
        )
        self.file = RunFile(path, city)
        self._frame_due_ns: dict[str, int] = {}
        self._flush_due_ns = 0
        self._status_due_ns = 0

    def step(self, now_ns: int, inbox: Sequence[Incoming | RawSample]) -> list[Outgoing]:
        """Write the inbox; flush four times a second."""
        for item in inbox:
            if isinstance(item, RawSample) and self._is_stored(item):
                self.file.write(item)
        if now_ns >= self._flush_due_ns:
            self._flush_due_ns = now_ns + FLUSH_NS
            self.file.flush()
        if now_ns < self._status_due_ns:
            return []
        self._status_due_ns = now_ns + NS_PER_S
        detail = f"{self.file.messages} messages in {self.file.path.name}"
        return [PartStatus(station=self.name, t_ns=now_ns, detail=detail)]

    def _is_stored(self, sample: RawSample) -> bool:
        """Return whether to store a message: all but pictures that are not due yet."""
        kind = self.file.kind_of(sample.key)
        if kind not in self._period_ns:
            return True
        period_ns = self._period_ns[kind]
        due_ns = self._frame_due_ns.get(sample.key, sample.t_ns)
        if period_ns is None or sample.t_ns < due_ns:
            return False
        # Counted from when it was due: jittering 5 Hz frames give 1 Hz, not 0.83.
        late = sample.t_ns - due_ns >= period_ns
        self._frame_due_ns[sample.key] = (sample.t_ns if late else due_ns) + period_ns
        return True

    def finish(self, now_ns: int) -> list[Outgoing]:
        """Complete the file with its index."""
        del now_ns
        self.file.close()
        return []


def _without_cars() -> tuple[type[Message], ...]:
    """Return all message classes but those that every car sends."""
    return tuple(
        kind
        for kind in message_classes()
        if kind.DELIVERY not in (Delivery.RPC, Delivery.PRESENCE) and kind not in OF_EACH_CAR
    )


def _cameras(cars: Sequence[str]) -> tuple[Subscription, ...]:
    """Return the subscriptions to some cars' own cameras, or all cars' if none is named.

    Raises:
        MessageError: when a name is not a valid car name.
    """
    for name in cars:
        check_name(name, "cameras_of")
    where: list[dict[str, str]] = [{"vehicle": name} for name in cars] or [{}]
    return tuple(Subscription(CameraFrame, each, raw=True) for each in where)


def _period_ns(name: str, rate_hz: float) -> int | None:
    """Return the time between pictures; None for no pictures."""
    if not 0.0 <= rate_hz < float("inf"):
        msg = f"{name}: got {rate_hz}, expected 0 or more"
        raise RecordingError(msg)
    return round(NS_PER_S / rate_hz) if rate_hz else None
