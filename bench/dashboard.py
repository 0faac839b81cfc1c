"""The dashboard and its interface beside their limits, in a live city and a headless Chromium.

`python -m bench dashboard [--only paint|frames|api|sse] ...`; each starts `scm up` on a grid city:

    paint   200 cars: first paint of the map page, its first drawn car, and the slowest answer to a
            click or a key (event timing: from the touch to the next picture)
    frames  1000 cars: frames a second that the map draws, by its own count
    api     100 cars: 200 requests a second at even beats, from when each was due to its last byte,
            after each path was asked once, for a process looks some things up but once
    sse     100 cars: processor time of the server for 50 viewers, of JSON and of the binary stream

Nothing else should run on the machine; the load is printed with each number, and what a virtual
machine's host took.
"""

import argparse
import asyncio
import json
import os
import statistics
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.city_live import city, used_s

CHROMIUM = "/usr/bin/chromium"
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"]
PATIENCE_MS = 120_000
WARM_UP_S, START_S, LEAST_TICKS, KEEPS_UP = 5.0, 300.0, 250, 0.9
SPAN_S = 12.0

PAINT_CARS, BAR_PAINT_MS, BAR_TOUCH_MS = 200, 1000.0, 100.0
FRAME_CARS, BAR_FRAMES = 1000, 20.0
API_CARS, API_RATE, BAR_API_MS, CONNECTIONS = 100, 200.0, 20.0, 24
VIEWERS, BAR_SHARE = 50, 0.15
PATHS = ("vehicles", "signals", "stop", "stations", "vehicles/n7", "events?limit=20", "session")
MAPS = {100: "grid:3x3:12", 200: "grid:4x4:12", 1000: "grid:6x6:12"}
SCENE = "/static/js/pages/map/scene.js"

NOTE_TOUCHES = """
window.touches = [];
new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
        if (entry.interactionId) window.touches.push([entry.name, entry.duration]);
    }
}).observe({ type: "event", durationThreshold: 16, buffered: true });
window.opened = {};
addEventListener("click", ({ target, timeStamp }) => {
    const name = target.closest("nav a")?.pathname.slice(1);
    const look = () => {
        if (!document.querySelector(`main.at-${name} > *`)) requestAnimationFrame(look);
        else window.opened[name] = Math.round(performance.now() - timeStamp);
    };
    if (name) requestAnimationFrame(look);
});
"""

FIRST_CAR = """async (scene) => {
    const { drawn } = await import(scene);
    while (!drawn.cars) await new Promise(requestAnimationFrame);
    return performance.now();
}"""


def main() -> None:
    """Print a line for each limit."""
    parser = argparse.ArgumentParser(prog="python -m bench dashboard", description=__doc__)
    parser.add_argument("--only", action="append", choices=tuple(PARTS))
    for name in parser.parse_args().only or PARTS:
        before = processors()
        PARTS[name]()
        time_all, stolen = (now - then for now, then in zip(processors(), before, strict=True))
        print(f"    other machines took {100.0 * stolen / time_all:.1f} % of the processors")


def processors() -> tuple[int, int]:
    """Return the time of all processors so far, and how much of it a host gave to others [jiffies].

    Of the first line of Linux' /proc/stat; nothing is stolen on a machine of one's own.
    """
    with Path("/proc/stat").open() as file:
        jiffies = [int(word) for word in file.readline().split()[1:9]]
    return sum(jiffies), jiffies[7]


def report(
    what: str, value: float, limit: float, unit: str, *, more_is_better: bool = False
) -> None:
    held = value >= limit if more_is_better else value <= limit
    load = os.getloadavg()[0]
    print(
        f"{what:<58}{value:9.1f} {unit:<4} limit {limit:g}  ratio {value / limit:5.2f}  "
        f"{'ok' if held else 'MISSED'}  (load {load:.1f})",
        flush=True,
    )


def warm_up(port: int) -> None:
    """Wait until the world has run for a while; print if it cannot keep up."""
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline:
        time.sleep(WARM_UP_S)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/vehicles") as answer:
            state = json.load(answer)
        if state["tick"] is not None and state["tick"] >= LEAST_TICKS:
            break
    if state["real_time_factor"] < KEEPS_UP:
        print(f"    the world does not keep up: {state['real_time_factor']:.2f} of real time")


@contextmanager
def visited(url: str, script: str = "") -> Iterator[Any]:
    """Open the map page in a new browser; yield it when cars are drawn."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        try:
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.set_default_timeout(PATIENCE_MS)
            page.add_init_script(script)
            page.goto(f"{url}/map")
            page.wait_for_selector("tr[data-car]")
            yield page
        finally:
            browser.close()


def paint() -> None:
    with city(PAINT_CARS, MAPS[PAINT_CARS]) as (_, _, port):
        warm_up(port)
        with visited(f"http://127.0.0.1:{port}", NOTE_TOUCHES) as page:
            painted = page.evaluate(
                "() => performance.getEntriesByName('first-contentful-paint')[0].startTime"
            )
            report(f"first contentful paint, {PAINT_CARS} cars", painted, BAR_PAINT_MS, "ms")
            drawn = page.evaluate(FIRST_CAR, SCENE)
            print(f"    the first car is drawn after {drawn:.0f} ms")
            touch(page)
            touches, opened = page.evaluate("() => [window.touches, window.opened]")
    slowest: dict[str, float] = {}
    for name, took_ms in touches:
        slowest[name] = max(slowest.get(name, 0.0), took_ms)
    worst = max(slowest.values(), default=16.0)
    half = statistics.median(took for _, took in touches) if touches else 16.0
    report(f"slowest touch to next picture, {PAINT_CARS} cars", worst, BAR_TOUCH_MS, "ms")
    print(f"    {len(touches)} of 16 ms and more, half under {half:.0f} ms; {slowest}")
    print(f"    pages are there after [ms]: {opened}")


def touch(page: Any) -> None:
    """Choose cars by mouse and keyboard, zoom, and go through the pages."""
    rows = page.locator("tr[data-car] .name")
    for number in range(8):
        rows.nth(number).click()
    page.focus(".cars .scroll")
    for _ in range(8):
        page.keyboard.press("ArrowDown")
    for label in ("Zoom in", "Zoom in", "Zoom out", "Follow the chosen car"):
        page.click(f'[aria-label="{label}"]')
    for name in ("signals", "events", "vehicles", "map"):
        page.click(f'nav a[href="/{name}"]')
        page.wait_for_selector(f"main.at-{name} > *")
    page.wait_for_timeout(500)


def frames() -> None:
    with city(FRAME_CARS, MAPS[FRAME_CARS]) as (_, _, port):
        warm_up(port)
        with visited(f"http://127.0.0.1:{port}") as page:
            page.wait_for_timeout(1000.0 * WARM_UP_S)
            rate, states, took_ms, cars = page.evaluate(
                """async ([scene, ms]) => {
                    const { drawn } = await import(scene);
                    const { fleet } = await import(scene.replace("scene", "fleet"));
                    const [began, first, state] = [performance.now(), drawn.frames, fleet.sequence];
                    await new Promise((resolve) => setTimeout(resolve, ms));
                    const s = (performance.now() - began) / 1000;
                    const count = drawn.frames - first;
                    return [count / s, (fleet.sequence - state) / s, drawn.took_ms, drawn.cars];
                }""",
                [SCENE, 1000.0 * SPAN_S],
            )
    report(f"map of {cars} cars: frames", rate, BAR_FRAMES, "/s", more_is_better=True)
    print(f"    {states:.1f} new states/s, {took_ms:.1f} ms to draw the last frame")


def api() -> None:
    with city(API_CARS, MAPS[API_CARS]) as (_, _, port):
        warm_up(port)
        took_ms = sorted(asyncio.run(request_evenly(port)))
    p99 = took_ms[int(0.99 * len(took_ms))]
    report(f"REST p99 at {API_RATE:g} requests/s, {API_CARS} cars", p99, BAR_API_MS, "ms")
    print(f"    {len(took_ms)} answers, p50 {statistics.median(took_ms):.1f} ms")


async def request_evenly(port: int) -> list[float]:
    """Ask at even beats over some connections; return each answer's time since it was due [ms]."""
    free: asyncio.Queue[Any] = asyncio.Queue()
    for _ in range(CONNECTIONS):
        free.put_nowait(await asyncio.open_connection("127.0.0.1", port))
    took_ms: list[float] = []

    async def request(due: float, path: str) -> None:
        reader, writer = await free.get()
        writer.write(f"GET /api/v1/{path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        head = await reader.readuntil(b"\r\n\r\n")
        if not head.startswith(b"HTTP/1.1 200"):
            raise SystemExit(f"{path}: {head.decode()}")
        length = int(head.lower().partition(b"content-length: ")[2].partition(b"\r")[0])
        await reader.readexactly(length)
        took_ms.append(1000.0 * (time.perf_counter() - due))
        free.put_nowait((reader, writer))

    for path in PATHS:
        await request(0.0, path)
    took_ms.clear()
    began, tasks = time.perf_counter(), list[asyncio.Task[None]]()
    for number in range(round(API_RATE * SPAN_S)):
        due = began + number / API_RATE
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        tasks.append(asyncio.create_task(request(due, PATHS[number % len(PATHS)])))
    await asyncio.gather(*tasks)
    return took_ms


def sse() -> None:
    with city(API_CARS, MAPS[API_CARS]) as (_, parts, port):
        warm_up(port)
        alone = asyncio.run(watch(port, parts["api"], 0, ""))[0]
        for name, path in (("SSE", "stream?topics=vehicles,signals"), ("binary", "vehicles.bin")):
            share, rate = asyncio.run(watch(port, parts["api"], VIEWERS, path))
            what = f"server for {VIEWERS} {name} viewers, {API_CARS} cars, beyond none"
            report(what, 100.0 * (share - alone), 100.0 * BAR_SHARE, "%")
            print(f"    {100 * share:.1f} % in all, {100 * alone:.1f} % alone; {rate:.1f} chunks/s")


async def watch(port: int, pid: int, viewers: int, path: str) -> tuple[float, float]:
    """Return the server's share of a core while so many listen, and the frames a viewer gets."""
    got = 0

    async def listen() -> None:
        nonlocal got
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=2**22)
        writer.write(f"GET /api/v1/{path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
        await reader.readuntil(b"\r\n\r\n")
        while True:  # chunked: each frame is a chunk
            length = int(await reader.readuntil(b"\r\n"), 16)
            await reader.readexactly(length + 2)
            got += 1

    tasks = [asyncio.create_task(listen()) for _ in range(viewers)]
    await asyncio.sleep(2.0)
    before, began, first = used_s(pid), time.perf_counter(), got
    await asyncio.sleep(SPAN_S)
    took = time.perf_counter() - began
    share = (used_s(pid) - before) / took
    for task in tasks:
        task.cancel()
    done = await asyncio.gather(*tasks, return_exceptions=True)
    for failure in done:
        if isinstance(failure, Exception):
            raise failure
    return share, (got - first) / took / max(1, viewers)


PARTS: dict[str, Callable[[], None]] = {"paint": paint, "frames": frames, "api": api, "sse": sse}


if __name__ == "__main__":
    main()
