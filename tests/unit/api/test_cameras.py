"""Pictures of cars' cameras: heard while somebody watches, and only then."""

import asyncio

import msgspec
import pytest

from scm.api.routes.cameras import _film
from scm.v2x.messages.camera_frame import CameraFrame

API = "/api/v1"


def frame(t_ns=1, vehicle="n1", camera="front"):
    return CameraFrame(
        vehicle=vehicle, camera=camera, t_ns=t_ns, width_px=2, height_px=1, payload=b"jpeg"
    )


def watched(view):
    return [one.where for one in view.subscriptions if one.kind is CameraFrame]


def test_a_camera_is_heard_for_as_long_as_anybody_watches_it(view):
    assert watched(view) == []
    with view.watching("n1", "front"):
        with view.watching("n1", "front"):
            assert watched(view) == [{"vehicle": "n1", "camera": "front"}]
        assert view.watched("n1") == ("front",)
    assert watched(view) == []


def test_pictures_are_kept_while_watched_and_then_forgotten(view, hear):
    with view.watching("n1", "front"):
        hear(1.0, frame(5), frame(6), frame(7, camera="rear"))
        assert view.camera_frame("n1", "front").message.t_ns == 6
        assert view.camera_frame("n1", "rear") is None
    assert view.camera_frame("n1", "front") is None


def test_a_still_picture_is_the_next_one_that_comes(app, client, view, hear, snapshot):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    with view.watching("n1", "front"):
        hear(1.1, frame(5))
        answer = client("GET", f"{API}/vehicles/n1/camera/front.jpg")
    assert answer.content == b"jpeg"
    assert answer.headers["content-type"] == "image/jpeg"
    assert answer.headers["x-time-ns"] == "5"
    assert watched(view) == []


@pytest.mark.parametrize(
    ("path", "status"),
    [("n9/camera/front.jpg", 404), ("n9/camera/front/film", 404), ("n1/camera/top.jpg", 404)],
)
def test_a_camera_that_is_not_there_is_refused(client, hear, snapshot, path, status):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    answer = client("GET", f"{API}/vehicles/{path}")
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_camera_that_the_car_lacks_is_refused_with_those_it_has(client, hear, snapshot):
    both = snapshot(n1=(0.0, 0.0, 0.0), n2=(1.0, 0.0, 0.0))
    nigel, other = both.vehicles
    dart = msgspec.structs.replace(other, car="dart")
    hear(1.0, msgspec.structs.replace(both, vehicles=(nigel, dart)))
    top = client("GET", f"{API}/vehicles/n1/camera/top/film").json()
    assert top["detail"] == "there is no camera named 'top': n1 has cameras front and rear"
    front = client("GET", f"{API}/vehicles/n2/camera/front.jpg")
    assert front.status_code == 404
    assert front.json()["detail"] == "there is no camera named 'front': n2 has no cameras"


def test_a_car_tells_its_cameras_and_which_are_watched(client, view, hear, snapshot):
    hear(1.0, snapshot(n1=(0.0, 0.0, 0.0)))
    with view.watching("n1", "rear"):
        answer = client("GET", f"{API}/vehicles/n1/camera").json()
    assert answer == {"cameras": ["front", "rear"], "watched": ["rear"]}
    assert client("GET", f"{API}/vehicles/n1").json()["cameras"] == ["front", "rear"]
    assert client("GET", f"{API}/vehicles/n9/camera").status_code == 404


class _City:
    def __init__(self, view):
        self.view = view


def test_a_film_is_every_new_picture_once_and_ends_with_its_page(app, view, hear):
    async def watch():
        film = _film(_City(view), app.state.stream, "n1", "front")
        coming = asyncio.ensure_future(anext(film))
        await asyncio.sleep(0)
        hear(1.0, frame(5))
        parts = [await coming]
        hear(1.1, frame(5))
        hear(1.2, frame(6))
        parts.append(await anext(film))
        during = watched(view)
        await film.aclose()
        return parts, during

    parts, during = asyncio.run(watch())
    assert [b"X-Time-Ns: 5" in parts[0], b"X-Time-Ns: 6" in parts[1]] == [True, True]
    assert parts[0].startswith(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 4\r\n")
    assert during == [{"vehicle": "n1", "camera": "front"}]
    assert watched(view) == []


def test_a_film_ends_with_the_server(app, view):
    async def watch():
        film = _film(_City(view), app.state.stream, "n1", "front")
        app.state.stream.close()
        return [part async for part in film]

    assert asyncio.run(watch()) == []
