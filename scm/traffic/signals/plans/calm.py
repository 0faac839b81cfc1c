"""Long greens: three times the least green for every stage, in the order of the map.

Less of the cycle is lost to yellow and clearance, so more cars pass in an hour; each waits longer.
"""

from scm.traffic.signals.kernel import Program
from scm.traffic.signals.plan import Plan, Stage, green_ns, stages


def cycle(program: Program) -> tuple[Stage, ...]:
    """Return every set of groups that fit together, with a long green."""
    return tuple(Stage(groups, 3 * green_ns(program, groups)) for groups in stages(program))


PLAN = Plan("long greens: more cars an hour, longer waits", cycle)
