"""Operations on eye of a city.

Written by docs/make/client.py: do not change it here.
"""

from collections.abc import Iterator
from typing import Any, Literal

from scm.client.connection import Connection, part
from scm.records.eye import CameraRow, CameraState, Overhead, PoseRow, Residuals, TrackList
from scm.records.eye_calibrations import CalibrationFile, CalibrationRow, View, Views
from scm.records.operations import Operation
from scm.records.page import Page
from scm.v2x.messages.calibration_request import CalibrationReply
from scm.v2x.messages.eye_tags import EyeTags


class EyeNoun:
    """Operations on eye."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def overhead(self) -> Overhead:
        """All cameras, with tags and poses seen."""
        return self._connection.request("GET", "/api/v1/eye", Overhead)

    def cameras(self, *, limit: int = 100, cursor: str = "") -> Page[CameraRow]:
        """The cameras, a page.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET", "/api/v1/eye/cameras", Page[CameraRow], query={"limit": limit, "cursor": cursor}
        )

    def camera(self, name: str) -> CameraState:
        """One camera.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/eye/cameras/{part(name)}", CameraState)

    def frame(self, name: str, *, t_ns: int | None = None) -> bytes:
        """A camera's newest picture.

        Args:
            name: a name on the bus
            t_ns: exposure of the picture; none: the newest
        """
        return self._connection.fetch(
            f"/api/v1/eye/cameras/{part(name)}/frame.jpg", query={"t_ns": t_ns}
        )

    def tags(self, name: str) -> EyeTags:
        """The tags found in a camera's newest picture.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/eye/cameras/{part(name)}/tags", EyeTags)

    def poses(self, *, limit: int = 100, cursor: str = "") -> Page[PoseRow]:
        """The newest pose of each car by each camera.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET", "/api/v1/eye/poses", Page[PoseRow], query={"limit": limit, "cursor": cursor}
        )

    def tracks(self) -> TrackList:
        """Where each car is by all cameras together."""
        return self._connection.request("GET", "/api/v1/eye/tracks", TrackList)

    def residuals(
        self, name: str, *, window_s: float = 120.0, vehicle: str = "", most: int = 1000
    ) -> Residuals:
        """How far a camera's poses lay from the truth.

        Args:
            name: a name on the bus
            window_s: how far back [s]
            vehicle: one car; empty: all
            most: samples at most, evenly taken
        """
        return self._connection.request(
            "GET",
            f"/api/v1/eye/cameras/{part(name)}/residuals",
            Residuals,
            query={"window_s": window_s, "vehicle": vehicle, "most": most},
        )

    def views(self, name: str) -> Views:
        """Pictures of a board, and what was found in them.

        Args:
            name: a name on the bus
        """
        return self._connection.request("GET", f"/api/v1/eye/cameras/{part(name)}/views", Views)

    def add_view(self, name: str, *, content: bytes, idempotency_key: str = "") -> View:
        """Keep a picture of a board: one that is sent, or the camera's newest.

        Args:
            name: a name on the bus
            content: What to send.
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.send(
            "POST", f"/api/v1/eye/cameras/{part(name)}/views", View, content, key=idempotency_key
        )

    def delete_views(self, name: str, *, idempotency_key: str = "") -> Views:
        """Throw all pictures of a board away.

        Args:
            name: a name on the bus
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE", f"/api/v1/eye/cameras/{part(name)}/views", Views, key=idempotency_key
        )

    def view(self, name: str, view: str) -> bytes:
        """A picture of a board.

        Args:
            name: a name on the bus
            view: a picture's file name
        """
        return self._connection.fetch(f"/api/v1/eye/cameras/{part(name)}/views/{part(view)}")

    def delete_view(self, name: str, view: str, *, idempotency_key: str = "") -> Views:
        """Throw a picture of a board away.

        Args:
            name: a name on the bus
            view: a picture's file name
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/eye/cameras/{part(name)}/views/{part(view)}",
            Views,
            key=idempotency_key,
        )

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
            name: a name on the bus
            board: what was printed
            columns: squares, or tags, across
            rows: squares, or tags, down
            square_m: edge of a square; of tags middle to middle
            marker_m: black edge of a marker or tag
            dictionary: markers of a ChArUco board
            first_id: of the tag at the lower left
            fisheye: a lens of more than about 100 degrees
            save_as: what the lens is called, as with a place; null: only look
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/eye/cameras/{part(name)}/lens",
            Operation,
            body={
                "board": board,
                "columns": columns,
                "rows": rows,
                "square_m": square_m,
                "marker_m": marker_m,
                "dictionary": dictionary,
                "first_id": first_id,
                "fisheye": fisheye,
                "save_as": save_as,
            },
            key=idempotency_key,
        )

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
            name: a name on the bus
            lens: a stored lens; null: the map's
            tags: tags on the floor beside the map's: id, x_m, y_m, yaw_rad, size_m of each
            save_as: what the result is called, with a number where it is taken by then
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/eye/cameras/{part(name)}/place",
            Operation,
            body={"lens": lens, "tags": tags, "save_as": save_as},
            key=idempotency_key,
        )

    def calibrations(self, *, limit: int = 100, cursor: str = "") -> Page[CalibrationRow]:
        """All calibrations kept, newest first.

        Args:
            limit: rows a page
            cursor: `next` of the page before; empty: the first page
        """
        return self._connection.request(
            "GET",
            "/api/v1/eye/calibrations",
            Page[CalibrationRow],
            query={"limit": limit, "cursor": cursor},
        )

    def calibration(self, name: str) -> CalibrationFile:
        """One.

        Args:
            name: a calibration's name
        """
        return self._connection.request(
            "GET", f"/api/v1/eye/calibrations/{part(name)}", CalibrationFile
        )

    def write(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        toml: str,
        idempotency_key: str = "",
    ) -> CalibrationFile:
        """Put a calibration on the shelf, or another text in its place.

        Args:
            name: a calibration's name
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            toml: a lens of `scm eye calibrate`, or one [[cameras]] block
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/eye/calibrations/{part(name)}",
            CalibrationFile,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            body={"toml": toml},
            key=idempotency_key,
        )

    def delete(
        self,
        name: str,
        *,
        if_match: str | None = None,
        if_none_match: str | None = None,
        idempotency_key: str = "",
    ) -> CalibrationFile:
        """Take a calibration off the shelf.

        Args:
            name: a calibration's name
            if_match: ETag of the state that was edited; `*`: whichever there is
            if_none_match: `*`: only where there is none yet
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "DELETE",
            f"/api/v1/eye/calibrations/{part(name)}",
            CalibrationFile,
            headers={"if-match": if_match, "if-none-match": if_none_match},
            key=idempotency_key,
        )

    def report(self, name: str) -> dict[str, Any]:
        """How a calibration was found.

        Args:
            name: a calibration's name
        """
        return self._connection.request(
            "GET", f"/api/v1/eye/calibrations/{part(name)}/report", dict[str, Any]
        )

    def download(self, name: str) -> Iterator[bytes]:
        """Download a calibration.

        Args:
            name: a calibration's name
        """
        return self._connection.pieces(f"/api/v1/eye/calibrations/{part(name)}/file.toml")

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
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why
            calibration: a stored calibration
            accept_unsure: whether it is meant although the Eye would flag its poses as unsure and
                guarded cars would stop; without it such a calibration is a 409 of code `unsure`
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "PUT",
            f"/api/v1/eye/cameras/{part(name)}/calibration",
            CalibrationReply,
            body={
                "by": by,
                "reason": reason,
                "calibration": calibration,
                "accept_unsure": accept_unsure,
            },
            key=idempotency_key,
        )

    def back(
        self, name: str, *, by: str = "", reason: str, idempotency_key: str = ""
    ) -> CalibrationReply:
        """Put back what the camera saw by before.

        Args:
            name: a name on the bus
            by: who requests it, for the log; empty: whoever calls
            reason: why
            idempotency_key: Same key, same effect, once; empty: a new one.
        """
        return self._connection.request(
            "POST",
            f"/api/v1/eye/cameras/{part(name)}/calibration/back",
            CalibrationReply,
            body={"by": by, "reason": reason},
            key=idempotency_key,
        )

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
        return self._connection.pieces(
            "/api/v1/eye/print/tags.pdf",
            query={"vehicles": vehicles, "paper": paper, "map_tag": map_tag},
        )

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
        return self._connection.pieces(
            "/api/v1/eye/print/board.pdf",
            query={
                "board": board,
                "columns": columns,
                "rows": rows,
                "square_mm": square_mm,
                "marker_mm": marker_mm,
                "first_id": first_id,
                "paper": paper,
            },
        )
