"""Doubts what a map says of the radio."""

from collections.abc import Iterator

from scm.records.city_map import CityMap

SHARES = ("loss", "hidden_share")
MAX_DELAY_MS = 1000.0


def radio_problems(city_map: CityMap) -> Iterator[str]:
    """Yield what is wrong with the radio's numbers, beyond their signs."""
    radio = city_map.radio
    for key in SHARES:
        value = getattr(radio, key)
        if value > 1.0:
            yield f"radio.{key}: expected a share, 0 to 1, got {value}"
    for key in ("delay_ms", "jitter_ms"):
        value = getattr(radio, key)
        if value > MAX_DELAY_MS:
            yield f"radio.{key}: expected at most {MAX_DELAY_MS:.0f}, got {value}"
    if radio.data_rate_mbps == 0.0 and (radio.hidden_share or radio.congestion_control):
        yield "radio.data_rate_mbps: expected more than 0 where the load counts, got 0"
