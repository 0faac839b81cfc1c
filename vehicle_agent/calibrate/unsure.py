"""Whether what was found is sure enough to drive by, in words."""

from vehicle_agent.calibrate.fit import Fit

WIDEST = {
    "steering.trim_rad": 0.01,
    "steering.gain": 0.05,
    "drive.deadband": 0.005,
    "drive.gain": 0.02,
}
"""Half of a 90 % interval: three to five times what a short drive finds."""
SILENT_SHARE = 0.25
"""Of the legs, so many may have been driven while the board was told nothing."""


def unsure(found: Fit) -> list[str]:
    """Return what is wrong with a drive, a line each; empty: its numbers may be used."""
    lines = []
    legs = found.windows + found.silent
    if found.silent > SILENT_SHARE * legs:
        lines.append(
            f"in {found.silent} of {legs} legs no command left for the board for 0.1 s: "
            "the computer had no time for it, or the cable was in trouble"
        )
    for key, widest in WIDEST.items():
        one = found.numbers[key]
        half = (one.high - one.low) / 2.0
        if half > widest:
            lines.append(f"{key} is known to {half:.3g} only, expected {widest:g}")
    return lines
