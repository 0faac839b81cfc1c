"""Reads a map file and doubts it: a bad map is refused with file, key, expected and got."""

import tomllib
from pathlib import Path

import msgspec

import scm
from scm.errors import MapError, nearest, reading
from scm.maps.check import problems_of
from scm.maps.grey import read_grey
from scm.maps.grid_city import named_city
from scm.maps.occupancy import map_from_occupancy
from scm.records.city_map import CityMap
from scm.records.floor import Record
from scm.toml_file import record_of

MAPS_DIR = Path(scm.__file__).parent.parent / "maps"

_YAML = {".yaml", ".yml"}
_PICTURES = {".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff"}
_KEYS = sorted({key for kind in Record.__subclasses__() for key in kind.__struct_fields__})


def map_names() -> list[str]:
    """Return the names of the maps that come with the project."""
    return sorted(path.stem for path in MAPS_DIR.glob("*.toml"))


def load_map(name_or_path: str | Path) -> CityMap:
    """Return a map by its name, or by the path of a map file or a scanned grid's `.yaml`.

    `grid:6x4` is a city made to measure; see `scm.maps.grid_city`.

    Raises:
        MapError: There is no such map; or it is wrong, with every reason that could be found.
    """
    made = named_city(str(name_or_path))
    if made is not None:
        return made
    path = _find(name_or_path)
    if is_scan(path):
        return map_from_occupancy(path)
    if path.suffix.lower() in _PICTURES:
        raise MapError(
            f"{path}: expected a map file, got a picture: give the .yaml that describes its cells"
        )
    with reading(path, "a TOML file", MapError):
        text = path.read_text(encoding="utf-8")
    return map_of(text, path)


def map_of(text: str, path: Path) -> CityMap:
    """Return the map that the text of a map file describes; `path` is where it is, or will be.

    Raises:
        MapError: It is wrong, with every reason that could be found.
    """
    city_map = _with_pictures(_read(text, path), path)
    problems = problems_of(city_map)
    if problems:
        lines = "".join(f"\n  {problem}" for problem in problems)
        raise MapError(f"{path}: {len(problems)} problem(s){lines}")
    return city_map


def is_scan(name_or_path: str | Path) -> bool:
    """Return whether a map is a scanned grid, by the ending of its file's name."""
    return Path(name_or_path).suffix.lower() in _YAML


def _find(name_or_path: str | Path) -> Path:
    """Return the file that is meant: an existing path first, then a name in the maps folder."""
    path = Path(name_or_path)
    if path.is_file():
        return path
    known = MAPS_DIR / f"{name_or_path}.toml"
    if known.is_file():
        return known
    if path.suffix.lower() in {".toml", *_YAML, *_PICTURES}:
        raise MapError(f"{path}: there is no such map file")
    names = map_names()
    raise MapError(
        f"no map {str(name_or_path)!r}{nearest(str(name_or_path), names)}: "
        f"expected a file, one of {', '.join(names)}, or a made city as in grid:6x4"
    )


def _read(text: str, path: Path) -> CityMap:
    """Return the file as a map whose keys and types are right."""
    with reading(path, "a TOML file", MapError):
        data = tomllib.loads(text)
    return record_of(data, CityMap, path, MapError, _KEYS)


def _with_pictures(city_map: CityMap, path: Path) -> CityMap:
    """Return the map with the grey values of the pictures it names: they lie beside its file."""
    floor = city_map.floor
    for key in ("friction_map", "height_map"):
        picture = getattr(floor, key)
        if picture is None:
            continue
        try:
            samples = read_grey(path.parent / picture.image)
        except MapError as error:
            raise MapError(f"{path}: floor.{key}.image: {error}") from error
        picture = msgspec.structs.replace(picture, samples=samples)
        floor = msgspec.structs.replace(floor, **{key: picture})
    return city_map if floor is city_map.floor else msgspec.structs.replace(city_map, floor=floor)
