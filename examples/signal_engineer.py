"""Give one approach more green: copy the plan, have the change proven, run it, take it back.

Start a city first, `.venv/bin/scm up driving_school`; then `python examples/signal_engineer.py`.
"""

import argparse

from scm.client import Client
from scm.client.stream import states
from scm.records.signal_plans import StageBody

NAME = "more_green"


def runs(city: Client, junction: str, plan: str, seconds: float) -> None:
    """Wait until a plan is in force, and that long again."""
    since_ns = None
    for state in states(city.stream.live(topics="signals")):
        row = next(row for row in state["signals"] if row["junction"] == junction)
        if row["plan"] == plan and row["t_ns"] is not None:
            since_ns = since_ns or row["t_ns"]
            if row["t_ns"] - since_ns >= seconds * 1e9:
                return


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:8000", help="of its dashboard")
    parser.add_argument("--more-s", type=float, default=4.0, help="more green (%(default)s)")
    parser.add_argument("--seconds", type=float, default=30.0, help="how long (%(default)s)")
    arguments = parser.parse_args()
    with Client(arguments.url) as city:
        row = city.signals.all_signals().signals[0]
        junction, before = row.junction, row.plan or row.plans[0]
        old = city.signals.one_plan(junction, before)
        more = (arguments.more_s, *[0.0] * len(old.stages))
        stages = tuple(
            StageBody(groups=one.groups, green_s=one.green_s + add_s, extra_red_s=one.extra_red_s)
            for one, add_s in zip(old.stages, more, strict=False)
        )
        city.wait(city.signals.prove(junction, plan=NAME, stages=stages))
        why = {"by": "example", "reason": "an example"}
        city.signals.save(junction, NAME, stages=stages, if_none_match="*", **why)
        try:
            city.signals.plan(junction, plan=NAME, **why)
            runs(city, junction, NAME, arguments.seconds)
        finally:
            city.signals.plan(junction, plan=before, **why)
            gone = city.signals.delete(junction, NAME, if_match="*")
        print(f"{junction}: cycle {old.cycle_s:.1f} s under {before}, {gone.cycle_s:.1f} s so")
        forecast = city.signals.promises(junction)
        broken = forecast.early + forecast.late
        print(f"{forecast.judged} colours ended as SPaT had promised, {broken} otherwise")


if __name__ == "__main__":
    main()
