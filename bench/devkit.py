"""An AutoDRIVE Devkit script at our bridge: round trips a second, and memory over time.

    python -m bench devkit [--generation 4.2|5.x] [--seconds 10] [--soak-s 3600] [--max-hz 0]

One Nigel in the driving school: states and measurements at 50 Hz, scans at 7 Hz, pictures (1280 x
720, quality 80, rendered before) at 15 Hz. The bridge's socket and the script, `tests/devkit/
script.py` under its own libraries, share one core. A round trip is packet, reply, next packet.
Beside the rate stands the CPU time that a round trip takes, of the script and of us: on a machine
that others use, its inverse is what a free core does.

A soak tells ten times in its span, since the line before: the rate, what is resident of us and of
the script, the longest time from one reply to the next, and how old the newest state of a packet
was when its reply came.
"""

import argparse
import gc
import itertools
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from array import array
from pathlib import Path

import cv2
import numpy as np

from scm.camera.daylight import Daylight
from scm.camera.optics import optics_of
from scm.camera.studio import Studio
from scm.clock import NS_PER_MS, NS_PER_S, WallClock
from scm.maps.load import load_map
from scm.maps.route import Path as Way
from scm.maps.route import Roads
from scm.records.signals import SignalGroup
from scm.v2x.messages.camera_frame import CameraFrame
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.spat import Spat
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_snapshot import SnapshotVehicle
from scm.vehicles.car import load_car
from tests.devkit.generations import GENERATIONS, SCRIPT, python_of
from vehicle_agent.devkit.commands import Commands
from vehicle_agent.devkit.engineio import ScriptSocket
from vehicle_agent.devkit.telemetry import Telemetry

PICTURES = 30
SOAK_PARTS = 10
WARM_S = 2.0
TICK = os.sysconf("SC_CLK_TCK")
CITY, CAR = load_map("driving_school"), load_car("nigel")


def pictures():
    """Return JPEGs by camera, as a car sees them on its way through the school."""
    studio, way = Studio(CITY, Daylight()), Way.circulation(Roads(CITY), CITY.lanes[0].name)
    shown = {light.light_id: "green" for light in CITY.lights}
    out = {"front": [], "rear": []}
    for number, camera in itertools.product(range(PICTURES), out):
        pose = way.at(way.length_m * number / PICTURES)
        own = SnapshotVehicle(
            vehicle="n1", kind="hosted", car="nigel", tag_id=1, speed_mps=0.2, steering_rad=0.0,
            x_m=pose.x, y_m=pose.y, yaw_rad=pose.yaw,
        )  # fmt: skip
        image = studio.picture(optics_of(CAR, camera), own, (own,), shown, camera, number)
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])
        out[camera].append(data.tobytes())
    return out


class FedCity:
    """Says what a city would say of one car, at its rates, on a thread of its own."""

    def __init__(self, telemetry, jpegs, clock):
        self.telemetry, self.jpegs, self.clock = telemetry, jpegs, clock
        self.stop = threading.Event()
        self.state_ns = 0
        telemetry.add_car("n1", "nigel", CAR)
        telemetry.show_lights([(light.junction, light.group) for light in CITY.lights])
        self.tick(0)
        self.thread = threading.Thread(target=self.run, daemon=True)

    def run(self):
        begin_ns = self.clock.now_ns()
        for tick in itertools.count(1):
            if self.clock.wait_until(begin_ns + tick * NS_PER_S // 50, self.stop):
                return
            self.tick(tick)

    def tick(self, tick):
        t_ns, update = self.clock.now_ns(), self.telemetry.update
        update(
            VehicleState(
                vehicle="n1", t_ns=t_ns, seq=tick, x_m=0.001 * tick, y_m=1.0, yaw_rad=0.1,
                speed_mps=0.2, yaw_rate_radps=0.0, steering_rad=0.05, throttle=0.5,
                source="simulated",
            )
        )  # fmt: skip
        self.state_ns = t_ns
        update(
            VehicleSensors(
                vehicle="n1", t_ns=t_ns, encoder_left=tick, encoder_right=tick,
                accel_mps2=(0.0, 0.1, 9.8), gyro_radps=(0.0, 0.0, 0.1),
                orientation_rad=(0.01, 0.0, 0.1), throttle=0.5, steering_rad=0.05,
            )
        )  # fmt: skip
        if tick % 7 == 0:
            ranges = (1.0 + 0.001 * np.arange(360) + 0.001 * tick).astype("<f4")
            scan = LidarScan(
                vehicle="n1", t_ns=t_ns, beams=360, range_min_m=0.15, range_max_m=12.0,
                payload=ranges.tobytes(),
            )  # fmt: skip
            update(scan)
            group = SignalGroup(group="south_east", colour="green", since_ns=t_ns, min_end_ns=t_ns)
            update(
                Spat(
                    junction="crossing", t_ns=t_ns, seq=tick, mode="plan", plan="p", groups=(group,)
                )
            )
        if tick * 15 // 50 != (tick - 1) * 15 // 50:
            for camera, jpegs in self.jpegs.items():
                payload = bytes(jpegs[tick % len(jpegs)])
                update(
                    CameraFrame(
                        vehicle="n1", camera=camera, t_ns=t_ns, width_px=1280, height_px=720,
                        payload=payload,
                    )
                )  # fmt: skip


def cpu_s(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def resident_mb(pid):
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class Watch:
    """Notes the time between replies and the age of what they answer, in milliseconds."""

    def __init__(self):
        self.state_ns = 0
        self.last_ns = None
        self.gaps, self.ages = array("f"), array("f")

    def note(self, now_ns):
        if self.last_ns is not None:
            self.gaps.append((now_ns - self.last_ns) / NS_PER_MS)
        self.last_ns = now_ns
        self.ages.append((now_ns - self.state_ns) / NS_PER_MS)

    def summary(self):
        """Return the longest gap, and the median, 99 % and greatest age; begin anew."""
        gaps, ages = self.gaps, self.ages
        self.gaps, self.ages = array("f"), array("f")
        return max(gaps, default=math.nan), *np.percentile(ages, (50, 99, 100))


class Bench:
    """The bridge's half without a bus, and a script."""

    def __init__(self, generation, jpegs, max_hz):
        self.folder = tempfile.TemporaryDirectory()
        log = str(Path(self.folder.name) / "log")
        command = [python_of(generation), "-W", "ignore", str(SCRIPT), "0", log]
        self.script = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        port = int(self.script.stdout.readline().split()[1])
        self.commands, self.telemetry = Commands(1), Telemetry(["n1"])
        self.commands.lights = len(CITY.lights)
        clock, self.watch = WallClock(), Watch()
        self.fed = FedCity(self.telemetry, jpegs, clock)
        self.socket = ScriptSocket(
            ("127.0.0.1", port), self.packet, self.replied, clock,
            round(NS_PER_S / max_hz) if max_hz else 0,
        )  # fmt: skip

    def packet(self):
        self.watch.state_ns = self.fed.state_ns
        return self.telemetry.packet()

    def replied(self, data, t_ns):
        self.commands.read(data)
        self.watch.note(t_ns)

    def __enter__(self):
        self.fed.thread.start()
        self.socket.start()
        return self

    def __exit__(self, *exc):
        self.socket.stop()
        self.fed.stop.set()
        self.script.kill()
        self.script.wait()
        self.script.stdout.close()
        self.folder.cleanup()

    def measure(self, span_s):
        """Return round trips a second, and CPU milliseconds a round trip: the script's, ours."""
        pace = self.socket.pace
        before = time.monotonic(), pace.replies, cpu_s(self.script.pid), time.process_time()
        time.sleep(span_s)
        if self.socket.pace is not pace:
            raise SystemExit(f"the conversation broke off: {self.socket.detail}")
        after = time.monotonic(), pace.replies, cpu_s(self.script.pid), time.process_time()
        passed, replies, theirs, ours = (b - a for a, b in zip(before, after, strict=True))
        return replies / passed, 1e3 * theirs / max(1, replies), 1e3 * ours / max(1, replies)


def rates(generation, span_s, max_hz, seen):
    for name, jpegs in (("two 720p cameras", seen), ("no cameras", {})):
        with Bench(generation, jpegs, max_hz) as bench:
            time.sleep(WARM_S)
            rate, theirs, ours = bench.measure(span_s)
        again, last = bench.socket.pace.again, bench.packet()
        size, sent = len(last.text(1)) / 1e3, len(last.deflated(1)) / 1e3
        print(
            f"{generation:4} {name:18}{rate:7.0f} /s {size:7.0f} kB a packet, {sent:.0f} deflated"
            f"{theirs:7.2f} ms CPU script {ours:6.2f} ms ours"
            f"{1e3 / (theirs + ours):6.0f} /s a core{again:4} again"
        )


def soak(generation, span_s, max_hz, seen):
    """Converse for long; say whether memory stays flat, and the worst stall and lag."""
    with Bench(generation, seen, max_hz) as bench:
        pids = {"ours": os.getpid(), "script": bench.script.pid}
        time.sleep(min(30.0, span_s / 10.0))
        gc.collect()
        begin = {who: resident_mb(pid) for who, pid in pids.items()}
        most = dict(begin)
        bench.watch.summary()
        for part in range(SOAK_PARTS):
            rate, _, _ = bench.measure(span_s / SOAK_PARTS)
            now = {who: resident_mb(pid) for who, pid in pids.items()}
            most = {who: max(most[who], now[who]) for who in now}
            gap, *ages = bench.watch.summary()
            held = ", ".join(f"{who} {mb:.1f} MB" for who, mb in now.items())
            print(
                f"{generation:4}{span_s * (part + 1) / SOAK_PARTS:6.0f} s{rate:5.0f} /s, {held}, "
                f"gap {gap:.0f} ms, age {ages[0]:.0f}, {ages[1]:.0f}, {ages[2]:.0f} ms "
                f"(50, 99, 100 %), {bench.socket.pace.again} again",
                flush=True,
            )
        for who, before in begin.items():
            grown = most[who] - before
            verdict = "flat" if grown <= 5.0 else "NOT flat"
            print(f"{who}: {grown:+.1f} MB at most in {span_s:.0f} s: {verdict} within 5 MB")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench devkit")
    parser.add_argument("--generation", choices=GENERATIONS, action="append")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--soak-s", type=float, default=0.0)
    parser.add_argument("--max-hz", type=float, default=0.0)
    options = parser.parse_args(sys.argv[1:])
    cv2.setNumThreads(1)
    seen = pictures()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for generation in options.generation or GENERATIONS:
        if options.soak_s:
            soak(generation, options.soak_s, options.max_hz or 50.0, seen)
        else:
            rates(generation, options.seconds, options.max_hz, seen)


if __name__ == "__main__":
    main()
