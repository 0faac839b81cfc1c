"""What did the simulator leave out? Have a recorded car searched, wait for it, read the report.

Start a city first, `.venv/bin/scm up driving_school`; then `python examples/diagnose.py NAME`, with
a recording on the city's shelf: `today` is `runs/today.mcap`, which Ctrl-C named.
"""

import argparse

from scm.client import Client
from scm.records.operations import Operation


def print_progress(work: Operation) -> None:
    if work.doing:
        print(f"{100.0 * (work.progress or 0.0):3.0f} %  {work.doing}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", help="on the city's shelf; without .mcap")
    parser.add_argument("--url", default="http://127.0.0.1:8000", help="of its dashboard")
    parser.add_argument("--vehicle", default="n1", help="which car (%(default)s)")
    parser.add_argument("--budget-s", type=float, default=60.0, help="time for it (%(default)s)")
    arguments = parser.parse_args()
    with Client(arguments.url) as city:
        work = city.mismatch.search(
            recording=arguments.recording, vehicle=arguments.vehicle, budget_s=arguments.budget_s
        )
        done = city.wait(work, print_progress)
        row = city.mismatch.report(done.result.rpartition("/")[2]).row
        print(row.said, *row.effects, sep="\n")
        if row.before_m is not None and row.after_m is not None:
            print(f"it strayed {row.before_m:.3f} m; with what was found, {row.after_m:.3f} m")
        print(f"{arguments.url}{done.result}")


if __name__ == "__main__":
    main()
