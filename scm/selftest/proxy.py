"""A TCP proxy that delays, stalls, cuts and resets the traffic through it, on command."""

import asyncio
import contextlib
import socket
import struct
import threading


class FaultyProxy:
    """Stands between a client and a Zenoh endpoint.

    Attributes:
        listen: The endpoint that clients connect to.
        delay_s: Added to each piece of data.
        stalled: While true nothing passes, and nothing is lost.
        connections: How many were opened so far.
    """

    def __init__(self, endpoint: str) -> None:
        """Listen at a free port, and forward to an endpoint `tcp/HOST:PORT`."""
        host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
        self._target = (host, int(port))
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.listen = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self.delay_s = 0.0
        self.stalled = False
        self.connections = 0
        self._thread = threading.Thread(target=self._run, name="proxy")

    def cut(self, *, reset: bool = False) -> None:
        """End all connections: politely, or by a reset that drops what is on its way."""
        self._loop.call_soon_threadsafe(self._cut, reset)

    def _cut(self, reset: bool) -> None:
        for writer in list(self._writers):
            if reset:
                link = writer.get_extra_info("socket")
                with contextlib.suppress(OSError):  # its other side has ended it already
                    link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            writer.transport.abort()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        serving = self._loop.run_until_complete(
            asyncio.start_server(self._connected, sock=self._listener)
        )
        self._loop.run_forever()
        serving.close()
        self._cut(reset=True)
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(asyncio.CancelledError):  # else Python 3.11 logs it
            await self._pass(reader, writer)

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        try:
            far_reader, far_writer = await asyncio.open_connection(*self._target)
        except OSError:
            writer.transport.abort()
            return
        ends = {writer, far_writer}
        self._writers |= ends
        ways = [self._carry(reader, far_writer), self._carry(far_reader, writer)]
        tasks = [asyncio.ensure_future(way) for way in ways]
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for end in ends:
            end.transport.abort()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._writers -= ends

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                if self.delay_s:
                    await asyncio.sleep(self.delay_s)
                while self.stalled:  # noqa: ASYNC110  set from another thread
                    await asyncio.sleep(0.01)
                writer.write(data)
                await writer.drain()

    def __enter__(self) -> "FaultyProxy":
        """Begin to forward."""
        self._thread.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
