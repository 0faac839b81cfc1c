"""A demonstration whose frames show a line that says how to steer, and a small network."""

import cv2
import numpy as np

from vehicle_agent.cloning.demonstration import FRAMES, About, Sample, write
from vehicle_agent.cloning.network import Convolution, Dense, Network

SMALL = Network("small", 24, 32, (Convolution(6, 5, 3), Dense(12)))
WIDTH, HEIGHT = 64, 40
PERIOD_NS = 100_000_000


def line(steering):
    """Return a frame with a bright line, left of the middle where the car is to steer left."""
    image = np.full((HEIGHT, WIDTH, 3), 60, np.uint8)
    x = round(WIDTH * (0.5 - 0.4 * steering))
    cv2.rectangle(image, (x - 3, 14), (x + 3, HEIGHT), (255, 255, 255), -1)
    return image


def demonstration(path, *, count=240, seed=0, car="nigel", late=0):
    """Write a demonstration of two laps; commands come so many frames late."""
    (path / FRAMES).mkdir(parents=True)
    shown, samples = np.random.default_rng(seed).uniform(-0.9, 0.9, count), []
    for number, steering in enumerate(shown.tolist()):
        name = f"{number:06d}.jpg"
        cv2.imwrite(str(path / FRAMES / name), line(steering))
        samples.append(
            Sample(
                frame=name, t_ns=number * PERIOD_NS, arrived_ns=number * PERIOD_NS + 10,
                steering=float(shown[max(0, number - late)]), throttle=0.4, speed_mps=0.2,
                lap=2 * number // count,
            )
        )  # fmt: skip
    about = About(
        demonstration=1, vehicle="n1", car=car, map="driving_school", width_px=1280,
        height_px=720, delay_s=0.03, laps=2,
    )  # fmt: skip
    write(path, about, samples)
    return path
