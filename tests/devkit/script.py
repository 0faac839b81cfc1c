"""A Devkit script as a student writes one, against the documented keys and nothing of ours.

    script.py PORT LOG [--drive constant|walls] [--cars N] [--crash-at N] [--slow S]

It runs under python-socketio 4.2 and 5.x, serves one client, reads every key of every packet and
answers each. What it saw goes to LOG, one JSON object a packet, the latest 2000.
"""

import argparse
import base64
import json
import struct
import sys
import time
from pathlib import Path

import eventlet
import eventlet.wsgi
import socketio

BEAMS = 360
SCALARS = ("Throttle", "Steering", "Speed", "LIDAR Scan Rate")
VECTORS = {
    "Encoder Ticks": 2,
    "Encoder Angles": 2,
    "Position": 3,
    "Orientation Quaternion": 4,
    "Orientation Euler Angles": 3,
    "Angular Velocity": 3,
    "Linear Acceleration": 3,
    "LIDAR Range Array": BEAMS,
    "LIDAR Intensity Array": BEAMS,
}
PICTURES = ("Front Camera Image", "Rear Camera Image")


def size_of(jpeg):
    """Return width and height from a JPEG's frame header."""
    assert jpeg[:2] == b"\xff\xd8", "not a JPEG"
    at = 2
    while at < len(jpeg):
        marker, length = jpeg[at + 1], struct.unpack(">H", jpeg[at + 2 : at + 4])[0]
        if marker in (0xC0, 0xC1, 0xC2):
            height, width = struct.unpack(">HH", jpeg[at + 5 : at + 9])
            return width, height
        at += 2 + length
    raise ValueError("no frame header")


def parse_data(data, name):
    """Return one vehicle's data; a missing key is a KeyError, as in the Devkit."""
    seen = {key: float(data[name + " " + key]) for key in SCALARS}
    for key, count in VECTORS.items():
        seen[key] = [float(word) for word in data[name + " " + key].split()]
        assert len(seen[key]) == count, (key, len(seen[key]))
    for key in PICTURES:
        seen[key] = base64.b64decode(data[name + " " + key])
        seen[key + " Size"] = size_of(seen[key])
    return seen


def follow_walls(ranges):
    """Return a steering towards the middle between what is left and right ahead."""
    near = [min(r, 1.0) for r in ranges]
    left = sum(near[30:70]) / 40.0
    right = sum(near[-70:-30]) / 40.0
    return max(-1.0, min(1.0, 1.5 * (left - right)))


class Student:
    def __init__(self, options):
        self.options = options
        self.packets = 0
        self.log = Path(options.log).open("w")  # noqa: SIM115  it is written while it runs

    def control(self, data):
        """Read one packet and return the commands that answer it."""
        self.packets += 1
        if self.packets == self.options.crash_at:
            raise KeyError("a packet that the script cannot read")
        if self.options.slow:
            eventlet.sleep(self.options.slow)
        commands, noted = {}, {"t": time.time(), "keys": len(data), "pid_packets": self.packets}
        assert all(isinstance(value, str) for value in data.values())
        for number in range(1, self.options.cars + 1):
            name = f"V{number}"
            seen = parse_data(data, name)
            steering = self.options.steering
            if self.options.drive == "walls":
                steering = follow_walls(seen["LIDAR Range Array"])
            commands[name + " Throttle"] = str(self.options.throttle)
            commands[name + " Steering"] = str(steering)
            commands[name + " Headlights"] = "2"
            commands[name + " Indicators"] = "3"
            noted[name] = {
                "position": seen["Position"][:2],
                "yaw": seen["Orientation Euler Angles"][2],
                "speed": seen["Speed"],
                "ticks": seen["Encoder Ticks"],
                "nearest": min(seen["LIDAR Range Array"]),
                "front": len(seen["Front Camera Image"]),
                "size": seen["Front Camera Image Size"],
            }
        noted["lights"] = [int(data[key]) for key in sorted(data) if key.startswith("TL")]
        if self.options.light:
            commands["TL1 State"] = self.options.light
        if self.packets <= 2000 or self.packets % 50 == 0:
            self.log.write(json.dumps(noted) + "\n")
            self.log.flush()
        return commands


def serve(options):
    student, sio = Student(options), socketio.Server()

    @sio.on("connect")
    def connect(sid, environ):
        print("connected", sid, flush=True)

    @sio.on("Bridge")
    def bridge(sid, data):
        if data:
            sio.emit("Bridge", data=student.control(data))

    try:
        from flask import Flask

        app = socketio.Middleware(sio, Flask(__name__))
    except ImportError:
        app = socketio.WSGIApp(sio)
    listener = eventlet.listen(("127.0.0.1", options.port))
    print("port", listener.getsockname()[1], flush=True)
    eventlet.wsgi.server(listener, app, log_output=False)


def main(argv):
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("log")
    parser.add_argument("--drive", default="constant", choices=("constant", "walls"))
    parser.add_argument("--cars", type=int, default=1)
    parser.add_argument("--throttle", type=float, default=0.5)
    parser.add_argument("--steering", type=float, default=0.0)
    parser.add_argument("--light", default="")
    parser.add_argument("--crash-at", type=int, default=0)
    parser.add_argument("--slow", type=float, default=0.0)
    serve(parser.parse_args(argv))


if __name__ == "__main__":
    main(sys.argv[1:])
