"""The light of the city: a sun and ambient light."""

import math
from dataclasses import dataclass

import numpy as np

from scm.arrays import Floats
from scm.errors import EyeError


@dataclass(frozen=True, slots=True)
class Daylight:
    """A sun without size and an even sky.

    Attributes:
        intensity: 1 is a well lit room; lamps that shine themselves do not depend on it.
        azimuth: Where the sun stands, over the floor, counter-clockwise from the map's x [rad].
        elevation: How high [rad].
        ambient: Share of the light that comes from everywhere.

    Raises:
        EyeError: naming what cannot be.
    """

    intensity: float = 1.0
    azimuth: float = 2.2
    elevation: float = 0.95
    ambient: float = 0.55

    def __post_init__(self) -> None:
        if not 0.0 <= self.intensity <= 20.0:
            raise EyeError(f"light intensity: expected 0 to 20, got {self.intensity}")
        if not 0.05 <= self.elevation <= math.pi / 2:
            raise EyeError(f"sun elevation: expected 0.05 to 1.57 rad, got {self.elevation}")
        if not 0.0 <= self.ambient <= 1.0:
            raise EyeError(f"ambient light: expected 0 to 1, got {self.ambient}")

    @property
    def sun(self) -> Floats:
        """Return the unit vector towards the sun, map frame, (3,)."""
        flat = math.cos(self.elevation)
        x, y = flat * math.cos(self.azimuth), flat * math.sin(self.azimuth)
        return np.array([x, y, math.sin(self.elevation)])

    def on_faces(self, normals: Floats) -> Floats:
        """Return the light on matt faces, (n, 3) to (n,): Lambert's cosine; the floor gets 1."""
        sun = self.sun
        towards = np.maximum(normals @ sun, 0.0) / sun[2]
        light: Floats = self.intensity * (self.ambient + (1.0 - self.ambient) * towards)
        return light

    def shadow_of(self, points: Floats) -> Floats:
        """Return where points throw their shadows on the floor, (n, 3) to (n, 2) [m]."""
        sun = self.sun
        thrown: Floats = points[:, :2] - points[:, 2:] * (sun[:2] / sun[2])
        return thrown
