"""Sheets for the Eye as PDF: the tags of the cars in the city, and boards. Loads OpenCV."""

from collections.abc import Sequence

from scm.api.city import City
from scm.scenery.board import Board, Kind
from scm.scenery.bodies import car_body
from scm.scenery.paper import pdf
from scm.scenery.prints import TagPrint, board_page, map_print, tag_pages, vehicle_print
from scm.vehicles.car_files import car_files

CAR = "nigel"
"""The car file of a name that is not in the city."""


def tag_sheets(city: City, names: Sequence[str], paper: str, *, map_tag: bool) -> bytes:
    """Return the roof tags of cars, each as the city has it now, else by its name.

    Args:
        city: Whose cars.
        names: Which; none: all that have a tag.
        paper: Its size, as `scm.scenery.paper` names it.
        map_tag: Whether with the tag on the floor.

    Raises:
        EyeError: A name has no tag, a tag is larger than the paper, or there is nothing to print.
    """
    snapshot = city.view.picture().snapshot
    cars = () if snapshot is None else snapshot.message.vehicles
    there = {car.vehicle: car for car in cars}
    prints: list[TagPrint] = [map_print(city.city_map)] if map_tag else []
    for name in names or sorted(name for name, car in there.items() if has_tag(car.car)):
        car = there.get(name)
        file, worn = (CAR, None) if car is None else (car.car, car.tag_id)
        prints.append(vehicle_print(city.city_map, name, file, worn))
    return pdf(tag_pages(prints, paper))


def has_tag(car: str) -> bool:
    """Return whether a car's file is here and gives its roof a tag."""
    return car in car_files() and car_body(car).has_tag


def board_sheet(
    kind: Kind, size: tuple[int, int], square_m: float, marker_m: float, first_id: int, paper: str
) -> bytes:
    """Return a board, as `Board` has it.

    Raises:
        EyeError: There is no such board, or it is larger than the paper.
    """
    marker = None if kind == "chessboard" else marker_m
    board = Board(kind, *size, square_m, marker, first_id=first_id)
    return pdf([board_page(board, paper)])
