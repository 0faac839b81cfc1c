"""Cameras of cars in a running city: pictures over the web while somebody watches, none else."""

import cv2
import httpx
import numpy as np
import pytest

from tests.e2e.city_process import city, wait_for

pytestmark = pytest.mark.e2e


def detail(running):
    """Return what the camera part says of itself."""
    stations = running.get("/stations")["stations"]
    return next(row["detail"] for row in stations if row["name"] == "camera")


def test_a_city_pictures_what_is_watched_and_nothing_else(tmp_path):
    with city(tmp_path, "--hosted", "2", "--agents", "1") as running:
        wait_for(lambda: detail(running) == "nobody looks", 20.0, "the camera part tells of itself")
        for car in ("n1", "n3"):
            answer = running.web.get(f"/vehicles/{car}/camera/front.jpg", timeout=20.0)
            assert answer.status_code == 200, answer.text
            image = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
            assert image.shape == (720, 1280, 3)
        film = f"{running.url}/api/v1/vehicles/n1/camera/rear/film"
        with httpx.stream("GET", film, timeout=20.0) as answer:
            kind = answer.headers["content-type"]
            assert kind.startswith("multipart/x-mixed-replace")
            parts = b""
            for piece in answer.iter_bytes():
                parts += piece
                if parts.count(b"Content-Type: image/jpeg") >= 5:
                    break
            wait_for(lambda: "1 camera," in detail(running), 10.0, "one camera is pictured")
        wait_for(lambda: detail(running) == "nobody looks", 10.0, "rendering ends with the film")
        assert running.get("/vehicles/n1/camera") == {"cameras": ["front", "rear"], "watched": []}
