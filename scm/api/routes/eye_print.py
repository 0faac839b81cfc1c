"""What is printed for the Eye, as PDF: roof tags of cars, the map tag, and boards."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from scm.api.city import City
from scm.api.problem import RefusedError
from scm.api.roles import VIEWER
from scm.api.schemas import answer_file
from scm.errors import EyeError

PDF = "application/pdf"
Paper = Annotated[
    Literal["A4", "A3", "A2", "A1", "A0", "letter", "tabloid"], Query(description="of the printer")
]
Count = Annotated[int, Query(ge=2, le=60, description="squares, or tags", examples=[9])]
Millimetres = Annotated[float, Query(gt=0.0, le=1000.0, description="[mm]", examples=[30.0])]


def router(city: City) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/eye/print", tags=["eye"], dependencies=[VIEWER])

    @routes.get(
        "/tags.pdf",
        summary="Roof tags of cars and the map's tag, to print at 100 %",
        response_class=Response,
        responses=answer_file(PDF, "Pages with a ruler of 100 mm on each."),
    )
    def print_tags(
        vehicles: Annotated[
            str,
            Query(
                pattern=r"^[a-z0-9_,-]{0,2000}$",
                description="names, separated by commas; empty: all cars of the city now",
                examples=["n1,n2"],
            ),
        ] = "",
        paper: Paper = "A4",
        *,
        map_tag: Annotated[
            bool, Query(description="whether with the tag on the floor", examples=[True])
        ] = True,
    ) -> Response:
        from scm.api.prints import tag_sheets  # noqa: PLC0415  loads OpenCV, rarely needed

        names = [name for name in vehicles.split(",") if name]
        with _refusing():
            return _pdf(tag_sheets(city, names, paper, map_tag=map_tag), "tags")

    @routes.get(
        "/board.pdf",
        summary="A board to measure a lens with, to print at 100 %",
        response_class=Response,
        responses=answer_file(PDF, "One page with a ruler of 100 mm."),
    )
    def print_board(
        board: Annotated[
            Literal["chessboard", "charuco", "tags"], Query(description="what kind")
        ] = "chessboard",
        columns: Count = 9,
        rows: Count = 6,
        square_mm: Millimetres = 30.0,
        marker_mm: Millimetres = 22.0,
        first_id: Annotated[
            int, Query(ge=0, le=586, description="of a grid of tags", examples=[0])
        ] = 0,
        paper: Paper = "A4",
    ) -> Response:
        from scm.api.prints import board_sheet  # noqa: PLC0415  loads OpenCV, rarely needed

        sizes = square_mm / 1000.0, marker_mm / 1000.0
        with _refusing():
            return _pdf(board_sheet(board, (columns, rows), *sizes, first_id, paper), "board")

    return routes


@contextmanager
def _refusing() -> Iterator[None]:
    try:
        yield
    except EyeError as error:
        raise RefusedError.of("invalid", str(error)) from error


def _pdf(content: bytes, name: str) -> Response:
    headers = {"Content-Disposition": f'inline; filename="{name}.pdf"', "Cache-Control": "no-store"}
    return Response(content, headers=headers, media_type=PDF)
