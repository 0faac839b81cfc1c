"""Take a car's wheel, weave left and right, give it back: how far did it come, how fast was it?

Start a city first, `.venv/bin/scm up driving_school`; then `python examples/drive_by_hand.py`. The
car stops when this program hangs or dies: nothing is sent but by `drive`.
"""

import argparse
import math
from itertools import pairwise

from scm.client import Client


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:8000", help="of its dashboard")
    parser.add_argument("--vehicle", default="", help="which car (the first)")
    parser.add_argument("--reason", default="", help="takes it from whoever holds it")
    parser.add_argument("--seconds", type=float, default=3.0, help="how long (%(default)s)")
    arguments = parser.parse_args()
    with Client(arguments.url) as city:
        vehicle = arguments.vehicle or city.vehicles.all_vehicles().vehicles[0].vehicle
        places, fastest_mps = [], 0.0
        with city.wheel(vehicle, arguments.reason) as wheel:
            for step in range(round(arguments.seconds / 0.05)):
                report = wheel.drive(throttle=0.4, steering=0.5 * math.sin(step / 8.0))
                fastest_mps = max(fastest_mps, report.speed_mps or 0.0)
                if step % 4 == 0:
                    car = city.vehicles.one_car(vehicle)
                    places.append((car.x_m, car.y_m))
        way_m = sum(math.dist(one, other) for one, other in pairwise(places))
        print(f"{vehicle} came {way_m:.2f} m by hand, at most {fastest_mps:.2f} m/s")
        if wheel.over is not None:
            print(f"the wheel is back: {wheel.over.detail}")


if __name__ == "__main__":
    main()
