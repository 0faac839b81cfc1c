"""Whether a way fits on a floor."""

from collections.abc import Sequence

from scm.geometry import Pose2

Span = tuple[float, float]
Way = Sequence[Pose2]


def laid_from(way: Way, start: Pose2) -> list[Pose2]:
    """Return a way as it would be from another pose: its own first pose comes to lie there."""
    if not way:
        return []
    to_start = way[0].inverse()
    return [start @ (to_start @ pose) for pose in way]


def is_inside(pose: Pose2, x_m: Span, y_m: Span, margin_m: float) -> bool:
    """Say whether a pose is on the floor, and so far from its edges [m]."""
    return (
        x_m[0] + margin_m <= pose.x <= x_m[1] - margin_m
        and y_m[0] + margin_m <= pose.y <= y_m[1] - margin_m
    )


def leaves(way: Way, x_m: Span, y_m: Span, margin_m: float) -> Pose2 | None:
    """Return the first pose of a way that is not inside; None: it fits."""
    return next((pose for pose in way if not is_inside(pose, x_m, y_m, margin_m)), None)
