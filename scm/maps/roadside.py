"""Where the roadside units stand."""

from scm.records.city_map import CityMap, Point


def roadside_place(city_map: CityMap, junction: str) -> Point:
    """Return where the roadside unit of a junction stands: amid its lights.

    A junction without lights gets the middle of the floor.
    """
    lights = [light for light in city_map.lights if light.junction == junction]
    if not lights:
        floor = city_map.floor
        return 0.5 * sum(floor.x_m), 0.5 * sum(floor.y_m)
    n = len(lights)
    return sum(light.x_m for light in lights) / n, sum(light.y_m for light in lights) / n
