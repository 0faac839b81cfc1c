"""Run the web application until it is stopped; the caller handles signals (Ctrl-C)."""

import asyncio
import contextlib
import itertools
import resource
import socket
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import h11
import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from scm.api.gate import check_bind
from scm.errors import RunError

_POLL_S = 0.05
LONGEST_PACKET = 4096  # bytes; a drive packet has about a hundred
PATIENCE_S = 10.0
IDLE_S = 75  # longer than clients and proxies reuse an idle connection: none is closed in their use
MOST_CONNECTIONS = 3000
FILES, OWN_FILES = 4096, 256  # as many as we request; of these the store, the bus and recordings
BACKLOG = 128
_numbers = itertools.count()


class _Server(uvicorn.Server):
    """Uvicorn without its signal handlers."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


class _Impatient(H11Protocol):
    """HTTP of uvicorn, which waits without limit for requests; and connections are limited.

    Every connection is accepted, it may be the city stop: of too many, the oldest of the
    address that has most of them goes.
    """

    patience_s = PATIENCE_S
    most = MOST_CONNECTIONS
    _waits: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Make room, and wait for the first request."""
        super().connection_made(transport)
        self.number = next(_numbers)
        if len(self.connections) > self.most:
            self._make_room()
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Wait while a head comes in pieces; again for each piece of a body."""
        super().data_received(data)
        # A WebSocket has limits of its own; for h11 its body is still to come.
        is_websocket = self.transport.get_protocol() is not self
        if self.conn.their_state is h11.IDLE and not is_websocket:
            self._wait()
            return
        if self._waits is not None:
            self._waits.cancel()
            self._waits = None
        if self.conn.their_state is h11.SEND_BODY and not is_websocket:
            self._wait()

    def _wait(self) -> None:
        if self._waits is None:
            self._waits = self.loop.call_later(self.patience_s, self._give_up)

    def _give_up(self) -> None:
        self._waits = None
        if self.transport.is_closing():
            return
        state = self.conn.their_state
        if state is h11.SEND_BODY and self.flow.read_paused:
            self._wait()  # it is we who are slow
        elif state in (h11.IDLE, h11.SEND_BODY):
            self.transport.close()

    def _make_room(self) -> None:
        """Cut one connection: not this one, nor one of somebody at a car's wheel."""
        there = [
            one
            for one in self.connections
            if isinstance(one, _Impatient) and one is not self and not one.transport.is_closing()
        ]
        if len(there) >= self.most:
            ((address, _),) = Counter(one.address for one in there).most_common(1)
            oldest = min((one for one in there if one.address == address), key=lambda o: o.number)
            oldest.transport.abort()  # to close would wait for who does not read

    @property
    def address(self) -> str:
        """Where it comes from."""
        return self.client[0] if self.client else ""


def serve(
    app: FastAPI,
    host: str,
    port: int,
    stop_event: threading.Event,
    *,
    proxies: Sequence[str] = (),
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Serve until `stop_event` is set, then end all streams and return within a second.

    Args:
        app: From `create_app`.
        host: Loopback, unless the application has API keys.
        port: 0 takes a free one.
        stop_event: Set by anybody, from any thread.
        proxies: Addresses or networks of proxies that are believed for whom they call.
        on_ready: Called once with the address (`http://127.0.0.1:8000`) when pages are served.

    Raises:
        RunError: when the host may not be bound, or the address is taken.
    """
    check_bind(host, app.state.keys)
    listener = _bind(host, port)
    _Impatient.most = _most_connections()
    config = uvicorn.Config(
        app,
        http=_Impatient,
        backlog=BACKLOG,
        proxy_headers=bool(proxies),  # X-Forwarded-For of anybody else cannot be trusted
        forwarded_allow_ips=list(proxies),
        ws="websockets-sansio",
        ws_max_size=LONGEST_PACKET,
        ws_per_message_deflate=False,
        log_config=None,
        access_log=False,
        lifespan="on",
        timeout_keep_alive=IDLE_S,
        timeout_graceful_shutdown=1,
        server_header=False,
    )
    asyncio.run(_serve(_Server(config), app, listener, stop_event, on_ready))


def _most_connections() -> int:
    """Let this process have the files that it needs; return how many may be connections."""
    most, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = FILES if hard == resource.RLIM_INFINITY else min(FILES, hard)
    if most != resource.RLIM_INFINITY and most < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return min(MOST_CONNECTIONS, max(wanted - OWN_FILES, wanted // 2))


async def _serve(
    server: uvicorn.Server,
    app: FastAPI,
    listener: socket.socket,
    stop_event: threading.Event,
    on_ready: Callable[[str], None] | None,
) -> None:
    serving = asyncio.create_task(server.serve([listener]))
    is_announced = False
    while not (stop_event.is_set() or serving.done()):  # a thread's event: it has to be polled
        if server.started and not is_announced:
            is_announced = True
            if on_ready is not None:
                on_ready(_address(listener))
        await asyncio.sleep(_POLL_S)
    app.state.stream.close()
    app.state.frames.close()
    server.should_exit = True
    await serving


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # Named TCP, else asyncio lets small answers wait for what the other side acknowledges: 40 ms.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as cause:
        listener.close()
        msg = f"api address {host}:{port}: {cause.strerror}; expected a free port of this machine"
        raise RunError(msg) from cause
    return listener


def _address(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
