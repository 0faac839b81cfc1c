"""LIDAR: ranges to walls and cars all around, counter-clockwise from straight ahead.

Each face is drawn into the bearings it subtends, and every bearing keeps the nearest:

    range = (a x d) / (u x d)        a: the face's start seen from the scanner, d: its direction,
                                     u: direction of the beam, x: cross product in the plane

Holds: a level scanner, all of one turn at one instant, faces without end upwards. A hit nearer than
the range's lower end counts as a miss, as everything beyond its upper end.   Source: AutoDRIVE
simulator (7 Hz, 0.15 to 12 m, 360 beams, miss = infinity), noise from the paper's variability test.
"""

import math

import numpy as np

from scm.arrays import Floats, Ints
from scm.vehicles.car import Car
from scm.vehicles.jit import array_kernel
from scm.vehicles.sensor import Around, Facts, Sensor, Sight, Truth

EDGE = 1e-9
SMALL = 1e-12


def facts(car: Car) -> Facts:
    """Return the device of a car file."""
    nearest, farthest = car.vector("lidar.range_m")
    return Facts(
        rate_hz=car.value("lidar.rate_hz"),
        noise=(car.value("lidar.noise_m"),),
        latency_s=car.value("lidar.latency_s"),
        drop_out=car.value("lidar.drop_out"),
        quantum=car.value("lidar.quantum_m"),
        seen=(nearest, farthest),
    )


def measure(car: Car, truth: Truth, rows: Ints, around: Sight | Around | None) -> Floats:
    """Return ranges (k, beams) [m]; infinity is a miss."""
    if isinstance(around, Sight):
        scene = around.scene
        edges = np.concatenate((scene.walls.edges, scene.outlines))
        owners = np.concatenate((np.full(len(scene.walls.edges), -1), np.repeat(scene.owners, 4)))
        around = Around(edges, owners, around.own)
    x, y, _ = car.vector("lidar.position_m")
    yaw = truth.yaw[rows]
    c, s = np.cos(yaw), np.sin(yaw)
    scanners = np.column_stack((truth.x[rows] + c * x - s * y, truth.y[rows] + s * x + c * y, yaw))
    return scan(car, scanners, around)


def scan(car: Car, scanners: Floats, around: Around | None) -> Floats:
    """Return what scanners like this car's see from given poses (k, 3) x, y, yaw."""
    beams = int(car.value("lidar.beams"))
    nearest, farthest = car.vector("lidar.range_m")
    ranges = np.full((len(scanners), beams), np.inf)
    if around is not None and len(around.edges):
        bearing = np.arange(beams) * (2.0 * math.pi / beams)
        cast(ranges, np.cos(bearing), np.sin(bearing), scanners, around.own, around.edges,
             around.owners, farthest)  # fmt: skip
    ranges[ranges < nearest] = np.inf
    return ranges


@array_kernel
def cast(
    ranges: Floats,
    ux: Floats,
    uy: Floats,
    scanners: Floats,
    own: Ints,
    edges: Floats,
    owners: Ints,
    farthest: float,
) -> None:
    """Lower `ranges` (k, beams) to the nearest face that each scanner sees along each beam."""
    beams = ranges.shape[1]
    step = 2.0 * math.pi / beams
    for k in range(scanners.shape[0]):
        x, y = scanners[k, 0], scanners[k, 1]
        c, s = math.cos(scanners[k, 2]), math.sin(scanners[k, 2])
        for m in range(edges.shape[0]):
            if owners[m] == own[k] and owners[m] >= 0:
                continue
            ex, ey = edges[m, 0] - x, edges[m, 1] - y
            fx, fy = edges[m, 2] - x, edges[m, 3] - y
            if (
                min(ex, fx) > farthest
                or max(ex, fx) < -farthest
                or min(ey, fy) > farthest
                or max(ey, fy) < -farthest
            ):
                continue
            ax, ay = c * ex + s * ey, c * ey - s * ex
            bx, by = c * fx + s * fy, c * fy - s * fx
            if ax * by - ay * bx < 0.0:
                ax, ay, bx, by = bx, by, ax, ay
            dx, dy = bx - ax, by - ay
            moment = ax * dy - ay * dx
            if moment <= SMALL:
                continue  # seen edge-on, or through the scanner itself
            start = math.atan2(ay, ax)
            span = math.atan2(moment, ax * bx + ay * by)
            first = math.ceil((start - EDGE) / step)
            last = math.floor((start + span + EDGE) / step)
            for i in range(first, last + 1):
                beam = i % beams
                across = ux[beam] * dy - uy[beam] * dx
                if across > 0.0:
                    distance = moment / across
                    if distance <= farthest and distance < ranges[k, beam]:
                        ranges[k, beam] = distance


SENSOR = Sensor(
    "lidar",
    ("range_m",),
    ("lidar.position_m", "lidar.rate_hz", "lidar.beams", "lidar.range_m", "lidar.noise_m"),
    facts,
    measure,
)
