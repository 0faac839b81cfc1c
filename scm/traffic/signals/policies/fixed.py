"""Fixed time: the timetable of the plan in force, coordinated with the neighbours.

Green waves come from the timetable's offset, see `signals/green_wave.py`. This is the only policy
whose changes are known in advance, so SPaT guarantees every end.
"""

from scm.traffic.signals.policy import Answer, JunctionView, Policy, Site, nothing


def step(site: Site, memory: None, view: JunctionView) -> tuple[None, Answer]:
    """Request what the timetable says."""
    del site
    return memory, Answer(view.timetabled)


POLICY = Policy(
    "fixed time: the plan's timetable, with an offset to the neighbours",
    nothing,
    step,
    is_timed=True,
    needs_detectors=False,
)
