"""Time from a frame's arrival to a command, for each network, on one core.

Run with `python -m bench cloning`: a rendered 1280 x 720 frame is decoded, cut and scaled, and the
network runs. Weights are random; they do not change the time. Times are the process's own.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import jax
import numpy as np

from scm import __version__
from scm.arrays import Floats, Image
from scm.camera.part import CameraPart
from scm.maps.load import load_map
from scm.runtime.lockstep import Lockstep
from scm.runtime.part import Subscription
from scm.v2x.messages.camera_frame import CameraFrame
from scm.world.part import WorldPart
from vehicle_agent.cloning.learning import write
from vehicle_agent.cloning.model_file import Metadata, Model
from vehicle_agent.cloning.network import NETWORKS, Network
from vehicle_agent.cloning.training import initial

MAP, CAR, VEHICLE = "driving_school", "nigel", "n1"
REPEATS, LIMIT_MS = 300, 2.0


def frame() -> bytes:
    """Return a frame of a car's front camera, JPEG."""
    city_map = load_map(MAP)
    parts = [WorldPart(city_map, 1, ((VEHICLE, CAR),)), CameraPart(city_map, 1)]
    with Lockstep(parts) as city:
        frames = city.subscribe(Subscription(CameraFrame, {"vehicle": VEHICLE, "camera": "front"}))
        city.run_for(1.0)
        return frames.drain()[-1].message.payload


def model_of(network: Network, folder: Path) -> Model:
    """Return a network with random weights, by way of its file."""
    weights = [
        (np.asarray(kernel), np.asarray(bias))
        for kernel, bias in initial(network, 1, jax.random.key(0))
    ]
    metadata = Metadata(
        model=1, network=network.name, outputs=("steering",), car=CAR, map=MAP, throttle=1.0,
        delay_s=0.0, frames=0, laps=0, epochs=0, seed=0, error=0.0, held_out_error=None,
        data_sha256="", scm=__version__,
    )  # fmt: skip
    path = folder / f"{network.name}.onnx"
    write(path, network, weights, metadata)
    return Model(path)


def times_ms(work: Callable[[], object]) -> Floats:
    """Return the times that a piece of work took this process [ms]."""
    spent = []
    for _ in range(REPEATS):
        begin = time.process_time()
        work()
        spent.append(1e3 * (time.process_time() - begin))
    return np.array(spent)


def main() -> None:
    """Print the table."""
    payload = np.frombuffer(frame(), np.uint8)
    cv2.setNumThreads(1)
    image: Image = np.asarray(cv2.imdecode(payload, cv2.IMREAD_COLOR), dtype=np.uint8)
    decoding = times_ms(lambda: cv2.imdecode(payload, cv2.IMREAD_COLOR))
    print(f"JPEG of {image.shape[1]} x {image.shape[0]} decoded: {np.median(decoding):.2f} ms\n")
    print(f"{'network':12}{'cut, scaled':>14}{'inference':>12}{'p99':>8}   of {LIMIT_MS:g} ms")
    with tempfile.TemporaryDirectory() as folder:
        for name, network in NETWORKS.items():
            model, view = model_of(network, Path(folder)), network.view([image])
            cut = np.median(times_ms(lambda one=network: one.view([image])))
            took = times_ms(lambda one=model, seen=view: one(seen))
            median, worst = np.median(took), np.percentile(took, 99)
            share = 100 * median / LIMIT_MS
            print(f"{name:12}{cut:11.2f} ms{median:9.2f} ms{worst:5.1f} ms{share:8.0f} %")


if __name__ == "__main__":
    main()
