"""Operations on eye of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator
from typing import Any, Literal

from scm.client.operation import Noun, operation
from scm.records.eye import CameraRow, CameraState, Overhead, PoseRow, Residuals, TrackList
from scm.records.eye_calibrations import CalibrationFile, CalibrationRow, View, Views
from scm.records.operations import Operation
from scm.records.page import Page
from scm.v2x.messages.calibration_request import CalibrationReply
from scm.v2x.messages.eye_tags import EyeTags


class EyeNoun(Noun):
    """Operations on eye."""

    @operation("GET", "/api/v1/eye")
    def overhead(self) -> Overhead:
        """All cameras, with tags and poses seen."""

    @operation("GET", "/api/v1/eye/cameras")
    def cameras(self, *, limit: int = 100, cursor: str = "") -> Page[CameraRow]:
        """The cameras, a page."""

    @operation("GET", "/api/v1/eye/cameras/{name}")
    def camera(self, name: str) -> CameraState:
        """One camera."""

    @operation("GET", "/api/v1/eye/cameras/{name}/frame.jpg")
    def frame(self, name: str, *, t_ns: int | None = None) -> bytes:
        """A camera's newest picture.

        Args:
            t_ns: exposure of the picture; none: the newest
        """

    @operation("GET", "/api/v1/eye/cameras/{name}/tags")
    def tags(self, name: str) -> EyeTags:
        """The tags found in a camera's newest picture."""

    @operation("GET", "/api/v1/eye/poses")
    def poses(self, *, limit: int = 100, cursor: str = "") -> Page[PoseRow]:
        """The newest pose of each car by each camera."""

    @operation("GET", "/api/v1/eye/tracks")
    def tracks(self) -> TrackList:
        """Where each car is by all cameras together."""

    @operation("GET", "/api/v1/eye/cameras/{name}/residuals")
    def residuals(
        self, name: str, *, window_s: float = 120.0, vehicle: str = "", most: int = 1000
    ) -> Residuals:
        """How far a camera's poses lay from the truth.

        Args:
            window_s: how far back [s]
            vehicle: one car; empty: all
            most: samples at most, evenly taken
        """

    @operation("GET", "/api/v1/eye/cameras/{name}/views")
    def views(self, name: str) -> Views:
        """Pictures of a board, and what was found in them."""

    @operation("POST", "/api/v1/eye/cameras/{name}/views")
    def add_view(self, name: str, *, content: bytes, idempotency_key: str = "") -> View:
        """Keep a picture of a board: one that is sent, or the camera's newest.

        Args:
            content: What to send.
        """

    @operation("DELETE", "/api/v1/eye/cameras/{name}/views")
    def delete_views(self, name: str, *, idempotency_key: str = "") -> Views:
        """Throw all pictures of a board away."""

    @operation("GET", "/api/v1/eye/cameras/{name}/views/{view}")
    def view(self, name: str, view: str) -> bytes:
        """A picture of a board.

        Args:
            view: a picture's file name
        """

    @operation("DELETE", "/api/v1/eye/cameras/{name}/views/{view}")
    def delete_view(self, name: str, view: str, *, idempotency_key: str = "") -> Views:
        """Throw a picture of a board away.

        Args:
            view: a picture's file name
        """

    @operation("POST", "/api/v1/eye/cameras/{name}/lens")
    def lens(
        self,
        name: str,
        *,
        board: Literal["charuco", "chessboard", "tags"] = "chessboard",
        columns: int,
        rows: int,
        square_m: float,
        marker_m: float | None = None,
        dictionary: str = "DICT_4X4_50",
        first_id: int = 0,
        fisheye: bool = False,
        save_as: str | None = None,
        idempotency_key: str = "",
    ) -> Operation:
        """Look for a board in all pictures, or measure the lens by them.

        Args:
            board: what was printed
            columns: squares, or tags, across
            rows: squares, or tags, down
            square_m: edge of a square; of tags middle to middle
            marker_m: black edge of a marker or tag
            dictionary: markers of a ChArUco board
            first_id: of the tag at the lower left
            fisheye: a lens of more than about 100 degrees
            save_as: what the lens is called, as with a place; null: only look
        """

    @operation("POST", "/api/v1/eye/cameras/{name}/place")
    def place(
        self,
        name: str,
        *,
        lens: str | None = None,
        tags: tuple[dict[str, float], ...] = (),
        save_as: str,
        idempotency_key: str = "",
    ) -> Operation:
        """Find where a camera hangs, by the tags on the floor that it sees now.

        Args:
            lens: a stored lens; null: the map's
            tags: tags on the floor beside the map's: id, x_m, y_m, yaw_rad, size_m of each
            save_as: what the result is called, with a number where it is taken by then
        """

    @operation("GET", "/api/v1/eye/calibrations")
    def calibrations(self, *, limit: int = 100, cursor: str = "") -> Page[CalibrationRow]:
        """All saved calibrations, newest first."""

    @operation("GET", "/api/v1/eye/calibrations/{name}")
    def calibration(self, name: str) -> CalibrationFile:
        """One.

        Args:
            name: a calibration's name
        """

    @operation("PUT", "/api/v1/eye/calibrations/{name}")
    def write(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        toml: str,
        idempotency_key: str = "",
    ) -> CalibrationFile:
        """Save a calibration, or replace its text.

        Args:
            name: a calibration's name
            toml: a lens of `scm eye calibrate`, or one [[cameras]] block
        """

    @operation("DELETE", "/api/v1/eye/calibrations/{name}")
    def delete(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        idempotency_key: str = "",
    ) -> CalibrationFile:
        """Delete a calibration.

        Args:
            name: a calibration's name
        """

    @operation("GET", "/api/v1/eye/calibrations/{name}/report")
    def report(self, name: str) -> dict[str, Any]:
        """How a calibration was found.

        Args:
            name: a calibration's name
        """

    @operation("GET", "/api/v1/eye/calibrations/{name}/file.toml")
    def download(self, name: str) -> Iterator[bytes]:
        """Download a calibration.

        Args:
            name: a calibration's name
        """

    @operation("PUT", "/api/v1/eye/cameras/{name}/calibration")
    def use(
        self,
        name: str,
        *,
        by: str = "",
        reason: str,
        calibration: str,
        accept_unsure: bool = False,
        idempotency_key: str = "",
    ) -> CalibrationReply:
        """See by a calibration from the next frame on.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why
            calibration: a stored calibration
            accept_unsure: whether it is meant although the Eye would flag its poses as unsure and
                guarded cars would stop; without it such a calibration is a 409 of code `unsure`
        """

    @operation("POST", "/api/v1/eye/cameras/{name}/calibration/back")
    def back(
        self, name: str, *, by: str = "", reason: str, idempotency_key: str = ""
    ) -> CalibrationReply:
        """Put back what the camera saw by before.

        Args:
            by: who requests it, for the log; empty: the caller
            reason: why
        """

    @operation("GET", "/api/v1/eye/print/tags.pdf")
    def print_tags(
        self,
        *,
        vehicles: str = "",
        paper: Literal["A4", "A3", "A2", "A1", "A0", "letter", "tabloid"] = "A4",
        map_tag: bool = True,
    ) -> Iterator[bytes]:
        """Roof tags of cars and the map's tag, to print at 100 %.

        Args:
            vehicles: names, separated by commas; empty: all cars of the city now
            paper: of the printer
            map_tag: whether with the tag on the floor
        """

    @operation("GET", "/api/v1/eye/print/board.pdf")
    def print_board(
        self,
        *,
        board: Literal["chessboard", "charuco", "tags"] = "chessboard",
        columns: int = 9,
        rows: int = 6,
        square_mm: float = 30.0,
        marker_mm: float = 22.0,
        first_id: int = 0,
        paper: Literal["A4", "A3", "A2", "A1", "A0", "letter", "tabloid"] = "A4",
    ) -> Iterator[bytes]:
        """A board to measure a lens with, to print at 100 %.

        Args:
            board: what kind
            columns: squares, or tags
            rows: squares, or tags
            square_mm: [mm]
            marker_mm: [mm]
            first_id: of a grid of tags
            paper: of the printer
        """
