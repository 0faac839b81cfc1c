"""What is sent over the radio comes out where it is heard: inside hosted cars, or on the bus."""

from collections.abc import Sequence

from scm.v2x.etsi_convert import read_cam
from scm.v2x.messages.cam_rx import CamRx
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.spatem_rx import SpatemRx
from scm.v2x.messages.spatem_tx import SpatemTx
from scm.world.ears import heard
from scm.world.hosted import HostedCar
from scm.world.world import World

Frame = CamTx | SpatemTx


def transmit(world: World, frames: Sequence[Frame], now_ns: int) -> None:
    """Bring frames to every station that hears them."""
    if not frames:
        return
    places = world.places()
    for frame in frames:
        receivers = world.radio.receivers(frame.station, places)
        hosted = [world.hosted[name] for name in receivers if name in world.hosted]
        if isinstance(frame, CamTx):
            _hear_cam(hosted, frame, now_ns)
        else:
            for car in hosted:
                car.signals.hear_spatem(frame.body, now_ns)
        world.outbox += [_received(n, frame) for n in receivers if n not in world.hosted]


def _hear_cam(cars: list[HostedCar], frame: CamTx, now_ns: int) -> None:
    told = heard(read_cam(frame.body), now_ns)
    if told is not None:
        for car in cars:
            car.ears.hear(frame.station, told)


def _received(receiver: str, frame: Frame) -> CamRx | SpatemRx:
    if isinstance(frame, CamTx):
        return CamRx(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)
    return SpatemRx(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)
