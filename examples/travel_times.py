"""Two cars lap the driving school under a calm and a brisk signal plan: which one is faster?

In lockstep (`python examples/travel_times.py`) or in the running city (`... --live`).
"""

import argparse
import time

from scm.fleet import open_city

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--live", action="store_true", help="use the city that `make run` started")
parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="its router (%(default)s)")
parser.add_argument("--cars", type=int, default=2, help="how many (%(default)s)")
parser.add_argument("--plans", nargs="+", default=["calm", "brisk"], help="(%(default)s)")
parser.add_argument("--via", nargs="+", default=["east_loop", "west_loop"], metavar="LANE",
                    help="where to drive (%(default)s)")  # fmt: skip
arguments = parser.parse_args()

began, speeds = time.perf_counter(), {}
with open_city("driving_school", connect=arguments.connect if arguments.live else None) as city:
    start_s = city.time_s
    cars = [city.spawn("nigel") for _ in range(arguments.cars)]
    for plan in arguments.plans:
        city.use_plan(plan)
        trips = [car.drive(*arguments.via) for car in cars]
        city.wait(trips, timeout_s=300.0)
        for trip in trips:
            length_m, time_s = trip.length_m, trip.duration_s
            void = f"  void: {'; '.join(trip.void)}" if trip.void else ""
            print(f"{plan:>6} {trip.vehicle:>4} {length_m:6.2f} m in {time_s:5.1f} s{void}",
                  flush=True)  # fmt: skip
        counted = [trip for trip in trips if not trip.void]
        if counted:
            # A trip starts where its car happens to be: compare speeds, not times.
            length_m = sum(trip.length_m for trip in counted)
            speeds[plan] = length_m / sum(trip.travel_time_s for trip in counted)
            print(f"{plan:>6} plan: {speeds[plan]:.3f} m/s on average")
    city_s, elapsed_s = city.time_s - start_s, time.perf_counter() - began
first, last = arguments.plans[0], arguments.plans[-1]
if first in speeds and last in speeds:
    print(f"{last} against {first}: {speeds[last] / speeds[first] - 1.0:+.0%} average speed")
else:
    print(f"{last} against {first}: not compared, all trips of a plan are void")
print(f"{city_s:.0f} s of city in {elapsed_s:.1f} s: {city_s / elapsed_s:.1f} x real time")
