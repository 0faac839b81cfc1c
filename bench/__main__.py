"""`make bench`: every benchmark, each number beside a peer or a limit measured in the same run."""

import importlib
import sys

BENCHMARKS = (
    "autonomy_mapping",
    "kernel",
    "driver",
    "world",
    "contacts",
    "city",
    "start",
    "study",
    "bus",
    "agents",
    "autonomy_local_plan",
    "autonomy_times",
    "codec",
    "eye",
    "camera",
    "cloning",
    "lidar",
    "recordings",
    "scans",
    "sensors",
    "signals",
    "signing",
)


LONG = (
    "autonomy_plan",
    "autonomy_real",
    "cloning_real",
    "dashboard",
    "devkit",
    "flow",
    "glosa",
    "gym",
    "gym_transfer",
    "handover",
    "joined",
    "kill",
    "misbehaviour",
    "mismatch",
    "recording_faults",
    "regions",
    "serial",
    "stop",
    "sumo",
    "twin",
    "twin_causes",
    "twin_forecast",
    "twin_false_alarms",
    "twin_peers",
)  # takes minutes: only where it is asked for, alone, with its own arguments


def main(names: list[str]) -> None:
    """Run the named benchmarks, or all of them."""
    if names and names[0] in LONG:
        names, sys.argv[1:] = names[:1], names[1:]
    for name in names or BENCHMARKS:
        module = importlib.import_module(f"bench.{name}")
        print(f"\n## {name}: {(module.__doc__ or '').partition(chr(10))[0]}\n", flush=True)
        module.main()


if __name__ == "__main__":
    main(sys.argv[1:])
