"""Short greens: just what the queue needs, and a step to spare, in the order of the map.

Nobody waits long while traffic is thin; a full queue does not clear in one green.
"""

from scm.traffic.signals.kernel import Program
from scm.traffic.signals.plan import Plan, Stage, green_ns, stages
from scm.traffic.signals.program import STEP_NS


def cycle(program: Program) -> tuple[Stage, ...]:
    """Return every set of groups that fit together, with the least green."""
    return tuple(Stage(groups, green_ns(program, groups) + STEP_NS) for groups in stages(program))


PLAN = Plan("short greens: short waits while traffic is thin", cycle)
