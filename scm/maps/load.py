"""Reads a map file and doubts it: a bad map is refused with file, key, expected and got."""

import re
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

MAPS_DIR = Path(scm.__file__).parent.parent / "maps"

_YAML = {".yaml", ".yml"}
_PICTURES = {".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff"}

_PATH = re.compile(r" - at `\$\.?(?P<path>.*)`$")
_PLAIN = (
    (re.compile(r"^Expected `([^`]+)`, got `([^`]+)`$"), r"expected \1, got \2"),
    (re.compile(r"^Object missing required field `([^`]+)`$"), r"key \1 is missing"),
    (re.compile(r"^Object contains unknown field `([^`]+)`$"), r"key \1 is not known here"),
    # The only value that is fixed is the format's number: `map = 1`.
    (re.compile(r"^Invalid enum value (.+)$"), r"expected 1 (the map format), got \1"),
    (re.compile(r"^Expected `array` of length (\d+), got (\d+)$"), r"expected \1 values, got \2"),
)
_UNKNOWN = re.compile(r"^key (?P<key>\S+) is not known here$")
_KEYS = sorted({key for kind in Record.__subclasses__() for key in kind.__struct_fields__})
_TYPES = {
    "str": "text in quotes",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "nothing",
}


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
    try:
        return msgspec.convert(data, CityMap)
    except msgspec.ValidationError as error:
        raise MapError(f"{path}: {_in_plain_words(str(error), data)}") from error


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


def _in_plain_words(message: str, data: object) -> str:
    """Return msgspec's sentence as `key: expected .., got ..` with the record's name."""
    found = _PATH.search(message)
    path = found["path"] if found else ""
    text = message[: found.start()] if found else message
    for pattern, plain in _PLAIN:
        if pattern.match(text):
            text = pattern.sub(plain, text)
            break
    if unknown := _UNKNOWN.match(text):
        text += nearest(unknown["key"], _KEYS)
    for python, word in _TYPES.items():
        text = re.sub(rf"\b(expected|got|\|) {python}\b", rf"\1 {word}", text)
    where = f"{path}{_name_at(path, data)}"
    return f"{where}: {text.replace(' | ', ' or ')}" if where else text


def _name_at(path: str, data: object) -> str:
    """Return ` (name)` of the innermost record on the way to a key that has a name or an id."""
    name = ""
    for step in re.findall(r"[^.\[\]]+", path):
        if isinstance(data, list) and step.isdigit() and int(step) < len(data):
            data = data[int(step)]
        elif isinstance(data, dict):
            data = data.get(step)
        if isinstance(data, dict):
            named = data.get("name", data.get("light_id", data.get("sign_id", "")))
            name = f" ({named})" if named != "" else name
    return name
