"""An IP camera over HTTP: a real server on this computer, killed and started again."""

import base64
import socket
import threading
import time
from contextlib import closing, suppress
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest

from scm.clock import NS_PER_S, WallClock
from scm.errors import EyeError
from scm.eye.sources.capture import DamagedFrameError
from scm.eye.sources.live import LiveSource
from scm.eye.sources.mjpeg import MjpegCapture

DEADLINE_S, SILENT_S = 20.0, 90.0


def jpeg(number):
    image = np.random.default_rng(number).integers(40, 200, (48, 64, 3), dtype=np.uint8)
    return cv2.imencode(".jpg", image)[1].tobytes()


def part(data, *lines, sized=True):
    size = [f"Content-Length: {len(data)}"] if sized else []
    head = "\r\n".join(["--edge", "Content-Type: image/jpeg", *lines, *size])
    return head.encode() + b"\r\n\r\n" + data + b"\r\n"


class Camera:
    """Service parts to everybody who asks; None among them: wait until it is killed."""

    def __init__(self, parts, port=0, kind="multipart/x-mixed-replace; boundary=edge", status=200):
        camera = self
        self.parts, self.sockets, self.asked = parts, [], []
        self.killed = threading.Event()

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                camera.asked.append((self.path, self.headers.get("Authorization")))
                camera.sockets.append(self.connection)
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.end_headers()
                with suppress(OSError):
                    for data in camera.parts:
                        if data is None:
                            camera.killed.wait(SILENT_S)
                        else:
                            self.wfile.write(data)

            def log_message(self, *words):
                del words

        self.server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self.server.daemon_threads = True
        self.port = self.server.server_port
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.02,))
        self.thread.start()

    @property
    def address(self):
        return f"http://127.0.0.1:{self.port}/film?of=1"

    def kill(self):
        self.killed.set()
        self.server.shutdown()
        self.thread.join()
        for one in self.sockets:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        self.server.server_close()


@pytest.fixture
def serve():
    cameras = []

    def make(*parts, **more):
        cameras.append(Camera(parts, **more))
        return cameras[-1]

    yield make
    for camera in cameras:
        camera.kill()


def opened(camera, timeout_s=DEADLINE_S):
    return MjpegCapture(camera.address, timeout_s)


def read(capture, count):
    frames = []
    for _ in range(count):
        capture.wait()
        frames.append(capture.fetch())
    capture.close()
    return frames


@pytest.mark.parametrize("sized", [True, False])
def test_every_frame_comes_whole_with_or_without_its_size(serve, sized):
    camera = serve(b"welcome\r\n", *(part(jpeg(i), sized=sized) for i in range(4)), b"--edge\r\n")
    for i, grabbed in enumerate(read(opened(camera), 4)):
        wanted = cv2.imdecode(np.frombuffer(jpeg(i), np.uint8), cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(grabbed.image, wanted)
    assert camera.asked == [("/film?of=1", None)]


def test_a_boundary_that_is_declared_with_its_dashes_is_understood(serve):
    kind = "multipart/x-mixed-replace;boundary=--edge"
    (grabbed,) = read(opened(serve(part(jpeg(0)), None, kind=kind)), 1)
    assert grabbed.image.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("text", "stamp_ns"),
    [("1700.25", 1_700_250_000_000), ("nan", None), ("soon", None), ("-3", None)],
)
def test_the_cameras_time_stamp_is_read_where_it_is_one(serve, text, stamp_ns):
    camera = serve(part(jpeg(0), f"X-Timestamp: {text}"), None)
    (grabbed,) = read(opened(camera), 1)
    assert grabbed.stamp_ns == stamp_ns


def test_name_and_password_are_sent_and_not_in_the_way(serve):
    camera = serve(part(jpeg(0)), None)
    MjpegCapture(f"http://me:p%40ss@127.0.0.1:{camera.port}/", DEADLINE_S).close()
    assert camera.asked == [("/", f"Basic {base64.b64encode(b'me:p@ss').decode()}")]


def test_a_jpeg_cut_short_is_one_damaged_frame_and_the_next_is_good(serve):
    camera = serve(part(jpeg(0)[:-30]), part(jpeg(1)), None)
    capture = opened(camera)
    capture.wait()
    with pytest.raises(DamagedFrameError, match="expected a whole JPEG, got one truncated"):
        capture.fetch()
    assert len(read(capture, 1)) == 1


@pytest.mark.parametrize(
    ("parts", "more", "said"),
    [
        ((), {"status": 401}, "the camera answers 401 Unauthorized"),
        ((), {"kind": "text/html"}, "expected a film of JPEGs .*, got text/html"),
        ((b"--edge\r\nContent-Length: 100\r\n\r\nshort",), {}, "95 bytes before a frame's end"),
        ((b"--edge\r\nContent-Length: 99999999\r\n\r\n",), {}, "67108864 bytes, got 99999999"),
        ((b"no part",), {}, "the camera ended the connection"),
    ],
)  # fmt: skip
def test_what_is_no_film_of_jpegs_is_said(serve, parts, more, said):
    camera = serve(*parts, **more)
    with pytest.raises(EyeError, match=said):
        opened(camera).wait()


def test_a_camera_that_says_nothing_is_given_up_after_the_time_limit(serve):
    camera = serve(None)
    with (
        pytest.raises(EyeError, match=r"no answer for 0\.2 s"),
        closing(opened(camera, timeout_s=0.2)) as capture,
    ):
        capture.wait()


def test_nobody_at_the_address_is_said():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(EyeError, match="refused"):
        MjpegCapture(f"http://127.0.0.1:{port}/")


def take_until(source, condition):
    ends, clock, times = time.monotonic() + DEADLINE_S, WallClock(), []
    while not condition():
        assert time.monotonic() < ends, source.problem
        frame = source.read(clock.now_ns(), None)
        times += [frame.t_ns] if frame else []
        time.sleep(0.005)
    return times


def test_a_camera_that_is_killed_and_started_again_comes_back_and_close_ends_its_thread():
    parts = [part(jpeg(i), f"X-Timestamp: {100.0 + 0.03 * i}") for i in range(5)]
    camera = Camera([*parts, None])
    source = LiveSource("ip", partial(opened, camera, SILENT_S), pauses_s=(0.02, 0.1))
    try:
        times = take_until(source, lambda: source.tally.good >= 1 and source._newest is None)
        camera.kill()
        times += take_until(source, lambda: "cannot open it" in (source.problem or ""))
        good = source.tally.good
        camera = Camera([*parts, None], port=camera.port)
        times += take_until(source, lambda: source.tally.good > good and source._newest is None)
        assert len(times) >= 2
        assert times == sorted(set(times))
        assert times[-1] < WallClock().now_ns() < times[-1] + DEADLINE_S * NS_PER_S
        source.close()  # the camera is silent now: only a broken connection ends the wait for it
        source._thread.join(DEADLINE_S)
        assert not source._thread.is_alive()
    finally:
        source.close()
        camera.kill()
