"""A world from above: the floor of its map, and its cars with their front wheels turned.

North is up. The first agent's car is blue, those of other agents purple, and those that no agent
drives grey; who is out is dark. Where cars have goals, the body stands there in white; where
junctions choose what is green, lines are green or red.
"""

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from gymnasium.error import Error

from scm.arrays import Floats, Image
from scm.gym.task import Task
from scm.gym.ways import ToGoal
from scm.gym.worlds import Worlds
from scm.maps.route import roads_of
from scm.scenery.canvas import Colour, colour_of
from scm.scenery.sheet import BRICK, CARDBOARD, FloorSheet, paint_floor, wall_pieces
from scm.scenery.solids import rectangle

RENDER_MODES = ["rgb_array"]
LONGER_SIDE_PX = 720
FIRST, AGENT, RULED, OUT = map(colour_of, ("#4c8df0", "#a97bf2", "#c3c8ce", "#5a6068"))
GOAL, GREEN, RED = map(colour_of, ("#eef1f4", "#35c26b", "#e0453a"))
LINE_M = 0.04  # a stop line that shows its signal is so wide
GLASS, TYRE = colour_of("#1d2733"), colour_of("#16181b")
WINDSCREEN = 0.55, 0.75  # of a body's length, from its rear
NARROWER = 0.8  # a windscreen than the body


def checked_mode(mode: str | None) -> str | None:
    """Return a render mode.

    Raises:
        gymnasium.error.Error: There is no such mode.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise Error(f"render_mode = {mode!r}: expected {', '.join(RENDER_MODES)} or None")
    return mode


def metadata_of(task: Task) -> dict[str, Any]:
    """Return what Gymnasium and PettingZoo want to know of pictures."""
    return {"render_modes": RENDER_MODES, "render_fps": 1.0 / task.period_s}


class Picture:
    """Pictures of some worlds, each of the whole map.

    Args:
        worlds: Of a task.
        longer_side_px: Of a picture.
    """

    def __init__(self, worlds: Worlds, longer_side_px: int = LONGER_SIDE_PX) -> None:
        self._worlds = worlds
        city_map, car = worlds.city_map, worlds.car
        (west, east), (south, north) = city_map.floor.x_m, city_map.floor.y_m
        extent = np.array([east - west, north - south])
        per_m = (longer_side_px - 2) / float(extent.max())
        self._floor = FloorSheet(west, north, extent, np.random.default_rng(0), per_m)
        paint_floor(self._floor, city_map)
        for wall in city_map.walls:
            for piece in wall_pieces(wall):
                self._floor.polygon(piece, BRICK)
        for box in city_map.boxes:
            outline = rectangle(box.x_m, box.y_m, box.length_m, box.width_m, box.yaw_rad)
            self._floor.polygon(outline, CARDBOARD)
        rear, front = car.vector("body.footprint_x_m")
        right, left = car.vector("body.footprint_y_m")
        width, middle = left - right, 0.5 * (left + right)
        self._body = rectangle(0.5 * (rear + front), middle, front - rear, width)
        at, end = (rear + share * (front - rear) for share in WINDSCREEN)
        self._glass = rectangle(0.5 * (at + end), middle, end - at, NARROWER * width)
        radius, tyre = car.value("wheel.radius_m"), car.value("wheel.width_m")
        self._wheel = rectangle(0.0, 0.0, 2.0 * radius, tyre)
        half, base = 0.5 * car.value("body.track_m"), car.value("body.wheelbase_m")
        self._hubs = (base, half), (base, -half)
        self._lines = list(_lines(worlds)) if worlds.junctions is not None else []

    def of(self, world: int = 0) -> Image:
        """Return a picture of a world, (height, width, 3), red, green, blue."""
        worlds, sheet = self._worlds, copy.copy(self._floor)
        sheet.picture = self._floor.picture.copy()
        if worlds.junctions is not None:
            for outline, group in self._lines:
                sheet.polygon(outline, GREEN if worlds.junctions.green[world, group] else RED)
        if isinstance(worlds.way, ToGoal):
            for goal in worlds.way.goals[worlds.cars[world]]:
                sheet.polygon(_placed(self._body, *map(float, goal)), GOAL)
        for number, row in enumerate(worlds.cars[world].tolist()):
            self._draw(sheet, row, self._colour(number, row))
        return np.ascontiguousarray(sheet.picture[:, :, ::-1])

    def _colour(self, number: int, row: int) -> Colour:
        """Return the paint of a car, by its number in its world."""
        if self._worlds.junctions is not None or number >= self._worlds.agents:
            return RULED
        if not self._worlds.present[row]:
            return OUT
        return AGENT if number else FIRST

    def _draw(self, sheet: FloorSheet, row: int, colour: Colour) -> None:
        fleet = self._worlds.fleet
        x, y, yaw = (float(values[row]) for values in (fleet.x, fleet.y, fleet.yaw))
        angle = float(fleet.steer_angle[row])
        for ahead, aside in self._hubs:
            sheet.polygon(_placed(_placed(self._wheel, ahead, aside, angle), x, y, yaw), TYRE)
        sheet.polygon(_placed(self._body, x, y, yaw), colour)
        sheet.polygon(_placed(self._glass, x, y, yaw), GLASS)


def _lines(worlds: Worlds) -> Iterator[tuple[Floats, int]]:
    """Yield the outline of each stop line on the floor, and the number of its signal group."""
    junctions, roads = worlds.city_map.junctions, roads_of(worlds.city_map)
    groups = [(junction.name, group.name) for junction in junctions for group in junction.groups]
    for line in worlds.city_map.stop_lines:
        path = roads.lane(line.lane)
        at = path.at(line.at_m)
        outline = rectangle(at.x, at.y, LINE_M, path.width_m, at.yaw)
        yield outline, groups.index((line.junction, line.group))


def _placed(points: Floats, x: float, y: float, yaw: float) -> Floats:
    """Return points of a body's frame, (n, 2), in the frame in which it stands at a pose."""
    c, s = math.cos(yaw), math.sin(yaw)
    placed: Floats = points @ np.array([[c, s], [-s, c]]) + (x, y)
    return placed
