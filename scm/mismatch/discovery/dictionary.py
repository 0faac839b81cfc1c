"""The dictionary of laws: every channel with every curve that makes sense there."""

from functools import cache

from scm.mismatch.discovery import channels as at
from scm.mismatch.discovery import shapes as by
from scm.mismatch.discovery.dictionary_effect import DictionaryEffect, dictionary_effect

_FLOOR = (by.TILES, by.WAVE, by.BEYOND, by.SLOPE)
_HEADING = (by.ONE_WAY, by.ROUND, by.BOTH_WAYS)
_TIME = (by.SWING, by.SINCE, by.DRIFT)
_SPEED = (by.SPEED, by.SPEED_SQUARED, by.SPEED_CUBED, by.FASTER)
_TURNED = (by.TURNED, by.TURNED_SQUARED, by.TURNED_CUBED, by.LEFT, by.RIGHT)
_ROWS = (
    (at.FLOOR, (by.SWING, by.SINCE)),
    (at.ALONG, (by.SWING,)),
    (at.DRAG, (*_HEADING, *_FLOOR, by.SINCE, by.DRIFT, by.SPEED_CUBED, by.FASTER, *_TURNED,
               by.TURNING)),
    (at.ANGLE, (*_TIME, by.ROUND, by.WAVE, by.BEYOND, by.SLOPE, by.SPEED, by.SPEED_SQUARED,
                by.DRIVEN)),
    (at.DEMAND, (by.SIDE, by.BENT)),
    (at.STEER_GAIN, (*_TIME, by.ROUND, by.BEYOND, by.SPEED, by.LOAD)),
    (at.THROTTLE, (*_TIME, by.ROUND, by.BEYOND, by.SPEED, by.TURNED, by.LEFT, by.RIGHT,
                   by.REVERSED, by.LOAD, by.WORKED)),
    (at.TWIST, (by.SWING, by.SINCE, *_SPEED[:2], by.DRIVEN)),
    (at.RIPPLE, (by.PHASE,)),
)  # fmt: skip


@cache
def dictionary() -> tuple[DictionaryEffect, ...]:
    """Return every law that may be tried."""
    return tuple(dictionary_effect(channel, curve) for channel, curves in _ROWS for curve in curves)
