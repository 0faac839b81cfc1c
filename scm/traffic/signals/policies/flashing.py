"""Flashing red: every approach is a stop sign; the way back leads through a clearance of all."""

from scm.traffic.signals.policy import Answer, JunctionView, Policy, Site, nothing


def step(site: Site, memory: None, view: JunctionView) -> tuple[None, Answer]:
    """Request nothing."""
    del site, view
    return memory, Answer(frozenset())


POLICY = Policy(
    "flashing red: stop, then go when it is free",
    nothing,
    step,
    is_flash=True,
    needs_detectors=False,
)
