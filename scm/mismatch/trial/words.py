"""Variables by many names: what a law depends on, said in one vocabulary."""

from collections.abc import Iterable

ALIKE = {
    "time": ("t", "phase in time", "period"),
    "heading": ("yaw", "direction", "direction of travel"),
    "position": ("x", "y", "place", "location", "x_m", "y_m", "map", "distance"),
    "speed": ("v", "vx", "velocity", "wheel speed"),
    "steering": (
        "steering angle", "wheel angle", "steering command", "command", "angle", "steering size",
    ),
    "side": ("steering sign", "steering side", "sign", "sign of steering", "left or right"),
    "phase": ("wheel phase", "wheel turn", "wheel rotation", "wheel position", "wheel revolution"),
    "throttle": ("drive command", "throttle command", "throttle sign"),
    "acceleration": ("accel_x", "along acceleration", "longitudinal acceleration"),
    "lateral acceleration": ("accel_y", "side acceleration"),
    "yaw rate": ("turn rate", "yaw_rate"),
}  # fmt: skip
ONE = {other: name for name, others in ALIKE.items() for other in others}


def plain(words: Iterable[str]) -> frozenset[str]:
    """Return variables by their first names."""
    clean = (word.strip().lower().replace("_", " ") for word in words)
    return frozenset(ONE.get(word, word) for word in clean)


def same_variables(said: Iterable[str], needs: Iterable[str], allows: Iterable[str] = ()) -> bool:
    """Say whether all that is needed was said, and nothing beside that is not allowed."""
    got, needed = plain(said), plain(needs)
    return needed <= got <= needed | plain(allows)
