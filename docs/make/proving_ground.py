"""Makes the two grey pictures of maps/proving_ground.toml: a wet bend and a hill with a hollow.

Run with `python docs/make/proving_ground.py`; the same pictures come out every time.
"""

from pathlib import Path

import cv2
import numpy as np

MAPS = Path(__file__).parents[2] / "maps"
WET_PIXELS, HILL_PIXELS = (140, 65), (120, 120)  # rows, columns: 2 cm and 1 cm each
ZERO, GREY_A_METRE = 20_000, 1_000_000


def wet_bend() -> np.ndarray:
    """Return puddles that run together: black is the wettest."""
    rng = np.random.default_rng(7)
    noise = rng.standard_normal(WET_PIXELS)
    noise = cv2.GaussianBlur(noise, (0, 0), 6.0)
    noise /= np.abs(noise).max()
    rows = np.linspace(-1.0, 1.0, WET_PIXELS[0])[:, None]
    columns = np.linspace(0.0, 1.0, WET_PIXELS[1])[None, :]
    dry = np.clip(np.abs(rows) ** 2 + columns**4, 0.0, 1.0)  # dry towards the straights
    wet = np.clip(0.9 + 1.3 * noise, 0.0, 1.0) * (1.0 - dry)
    return np.rint(255.0 * (1.0 - wet)).astype(np.uint8)


def hill() -> np.ndarray:
    """Return a hill of 35 mm and a hollow of 12 mm; the rim is level."""
    y, x = (np.linspace(-1.0, 1.0, size) for size in HILL_PIXELS)
    x, y = x[None, :], -y[:, None]

    def bump(at_x: float, at_y: float, radius: float) -> np.ndarray:
        away = np.hypot(x - at_x, y - at_y) / radius
        return np.where(away < 1.0, (1.0 - np.minimum(away, 1.0) ** 2) ** 2, 0.0)

    heights = 0.035 * bump(-0.25, 0.2, 0.7) - 0.012 * bump(0.5, -0.5, 0.42)
    return np.rint(ZERO + GREY_A_METRE * heights).astype(np.uint16)


if __name__ == "__main__":
    cv2.imwrite(str(MAPS / "proving_ground_wet.png"), wet_bend())
    cv2.imwrite(str(MAPS / "proving_ground_hill.png"), hill())
