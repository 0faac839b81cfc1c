"""What the twin part knows of cars, as it is shown: a row each, or all of one."""

import msgspec

from scm.api.picture import Picture
from scm.records.twins import Twin, TwinChange, TwinEffect, TwinRow
from scm.v2x.messages.twin_status import TwinStatus

MOST_SHARE = 0.999  # no probability is shown as certain


def twin_rows(picture: Picture) -> tuple[TwinRow, ...]:
    """Return each watched car in short, by name."""
    return tuple(_row(picture.twins[name].message) for name in sorted(picture.twins))


def twin_of(status: TwinStatus) -> Twin:
    """Return all that a status has."""
    return msgspec.convert(status, Twin, from_attributes=True)


def _row(status: TwinStatus) -> TwinRow:
    newest = status.changes[-1] if status.changes else None
    place = newest.causes[0] if newest is not None and newest.cause == "place" else None
    return TwinRow(
        vehicle=status.vehicle,
        car=status.car,
        t_ns=status.t_ns,
        state=status.state,
        reason=status.reason,
        driven_s=round(status.driven_s, 1),
        version=status.version,
        changes=len(status.changes),
        changed_ns=None if newest is None else newest.since_ns,
        search=None if newest is None else newest.search,
        newest="" if newest is None else in_short(newest),
        x_m=None if place is None else place.x_m,
        y_m=None if place is None else place.y_m,
        radius_m=None if place is None else place.radius_m,
    )


def in_short(change: TwinChange) -> str:
    """Return what a change is, in some words: what explains it, or what it looks like."""
    if change.cause == "place":
        return f"the floor at ({change.causes[0].x_m:.1f}, {change.causes[0].y_m:.1f}), not the car"
    if change.cause == "camera":
        return f"{f'camera {change.causes[0].camera}'.rstrip()}, not the car"
    if change.effects:
        return " and ".join(map(_effect, change.effects))
    if change.search == "unexplained":
        return "no known effect explains it"
    like = dict.fromkeys(change.between or (change.effect, *change.alike))
    return f"looks like {' or '.join(map(_spaced, like))}"


def _effect(effect: TwinEffect) -> str:
    share = min(effect.probability, MOST_SHARE)
    digits = 1 if share > 0.985 else 0
    return f"{_spaced(effect.name)}, {100.0 * share:.{digits}f} %"


def _spaced(name: str) -> str:
    return name.replace("_", " ")
