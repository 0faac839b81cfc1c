"""Watch a city from outside: how its cars move and its signals change, for some seconds.

Start a city first, `.venv/bin/scm up driving_school`; then `python examples/watch_city.py`. It
needs nothing of the city but its address: `scm.client` is typed and in step with the interface.
"""

import argparse
from time import monotonic

from scm.client import Client
from scm.client.stream import states


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:8000", help="of its dashboard")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long to watch")
    arguments = parser.parse_args()
    with Client(arguments.url) as client:
        (city,) = client.cities.all_cities().cities
        print(f"{city.title}: {city.vehicles} cars, {city.junctions} junctions")
        ends_s = monotonic() + arguments.seconds
        distance_m, before_s, colours = 0.0, monotonic(), ""
        for state in states(client.stream.live(topics="vehicles,signals")):
            now_s = monotonic()
            cars = state["vehicles"]["vehicles"]
            distance_m += sum(abs(car["speed_mps"]) for car in cars) * (now_s - before_s)
            before_s = now_s
            groups = [group for junction in state["signals"] for group in junction["groups"]]
            shown = "  ".join(f"{group['group']} {group['colour']}" for group in groups)
            if shown != colours:
                print(colours := shown)
            if now_s > ends_s:
                break
        print(f"all cars together drove {distance_m:.1f} m in {arguments.seconds:.0f} s")


if __name__ == "__main__":
    main()
