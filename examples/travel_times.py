"""Three cars lap the driving school under a calm and a brisk signal plan: who is faster?

In lockstep (`python examples/travel_times.py`) or in the running city (`... --live`).
"""

import argparse
import time

from scm.fleet import open_city

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--live", action="store_true", help="use the city that `make run` started")
parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="its router (%(default)s)")
arguments = parser.parse_args()

began = time.perf_counter()
with open_city("driving_school", connect=arguments.connect if arguments.live else None) as city:
    cars = [city.spawn("nigel") for _ in range(3)]
    for plan in ("calm", "brisk"):
        city.use_plan(plan)
        trips = [car.drive("east_loop", "west_loop", laps=2) for car in cars]
        city.wait(trips, timeout_s=300.0)
        times = [f"{trip.vehicle} {trip.travel_time_s:.1f} s" for trip in trips]
        print(f"{plan:>6}: {'   '.join(times)}   two laps, {trips[0].length_m:.1f} m")
    simulated = city.time_s
elapsed = time.perf_counter() - began
if not arguments.live:
    print(f"{simulated:.0f} s of city in {elapsed:.1f} s: {simulated / elapsed:.0f} x real time")
