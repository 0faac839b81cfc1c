"""Random scenes, and what every beam against every face says of them."""

import numpy as np

from scm.vehicles.rays.grid import WallGrid
from scm.vehicles.rays.scene import Scene

CIRCLE = (0.0, 2.0 * np.pi / 360, 360)


def boxes(places, yaw, along=(-0.07, 0.23), half=0.0875):
    """Return the faces of boxes, four a box, counter-clockwise."""
    u, v = np.array([along[0], along[1], along[1], along[0]]), np.array([-half, -half, half, half])
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y = places[:, :1] + c * u - s * v, places[:, 1:] + s * u + c * v
    corners = np.stack((x, y), axis=2)
    return np.concatenate((corners, np.roll(corners, -1, axis=1)), axis=2).reshape(-1, 4)


def clutter(seed, cars=60, walls=40, size=6.0):
    """Return a scene of cars and walls thrown about, and a scanner on each car."""
    rng = np.random.default_rng(seed)
    places, yaw = rng.uniform(-size, size, (cars, 2)), rng.uniform(-4.0, 4.0, cars)
    starts = rng.uniform(-size, size, (walls, 2))
    edges = np.column_stack((starts, starts + rng.normal(0.0, 1.5, (walls, 2))))
    scene = Scene(WallGrid(edges), boxes(places, yaw), np.arange(cars))
    return scene, np.column_stack((places, yaw))


def brute_force(scene, eyes, own, farthest):
    """Return the ranges of eyes (k, b, 3) x, y, direction: every beam against every face."""
    walls = scene.walls.edges
    edges = np.concatenate((walls, scene.outlines))
    owners = np.concatenate((np.full(len(walls), -1), np.repeat(scene.owners, 4)))
    out = np.empty(eyes.shape[:2])
    for k, beams in enumerate(eyes):
        faces = edges[(owners < 0) | (owners != own[k])]
        u = np.stack((np.cos(beams[:, 2]), np.sin(beams[:, 2])), axis=1)
        a = faces[None, :, :2] - beams[:, None, :2]
        d = faces[:, 2:] - faces[:, :2]
        across = u[:, :1] * d[:, 1] - u[:, 1:] * d[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (a[..., 0] * d[:, 1] - a[..., 1] * d[:, 0]) / across
            share = (a[..., 0] * u[:, 1:] - a[..., 1] * u[:, :1]) / across
        met = (distance > 0.0) & (share >= 0.0) & (share <= 1.0) & (distance <= farthest)
        out[k] = np.min(np.where(met, distance, np.inf), axis=1, initial=np.inf)
    return out


def eyes_of(scanners, bearings):
    """Return where each beam of scanners at rest looks from and to, (k, b, 3)."""
    first, step, beams = bearings
    eyes = np.repeat(scanners[:, None, :], beams, axis=1)
    eyes[:, :, 2] += first + step * np.arange(beams)
    return eyes
