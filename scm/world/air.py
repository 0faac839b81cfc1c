"""What is sent over the radio comes out where it is heard: inside hosted cars, or on the bus."""

from collections.abc import Sequence

from scm.v2x.messages.cam_rx import CamRx
from scm.v2x.messages.cam_tx import CamTx
from scm.v2x.messages.spatem_rx import SpatemRx
from scm.v2x.messages.spatem_tx import SpatemTx
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
        for car in hosted:
            if isinstance(frame, CamTx):
                car.others.hear(frame.body, now_ns)
            else:
                car.signals.hear_spatem(frame.body, now_ns)
        world.outbox += [_received(n, frame) for n in receivers if n not in world.hosted]


def _received(receiver: str, frame: Frame) -> CamRx | SpatemRx:
    if isinstance(frame, CamTx):
        return CamRx(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)
    return SpatemRx(receiver=receiver, station=frame.station, t_ns=frame.t_ns, body=frame.body)
