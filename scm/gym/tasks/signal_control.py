"""Control signals: each junction chooses what is green, and rules drive the cars.

The reward is what cars lose before the lines; queues and pressures are observed. Sources: Varaiya,
"Max pressure control of a network of signalized intersections", 2013; Wei et al., "PressLight",
2019.
"""

from scm.arrays import Floats
from scm.gym.task import Start, Task, Term, Traffic
from scm.gym.worlds import Worlds


def delay(worlds: Worlds) -> Floats:
    """Return what cars within 2 m before each junction's lines lost in this step [s]."""
    if worlds.junctions is None:
        raise TypeError(f"task {worlds.task.name}: `delay` needs agents that are junctions")
    return worlds.junctions.delay_s.ravel()


TASK = Task(
    name="signal_control",
    about="Let twelve cars lose as little time as possible in 300 s: two junctions choose stages.",
    maps=("market_town",),
    observations=("junction",),
    rewards=(Term(delay, -0.1),),
    ends=(),
    start=Start(is_abreast=True),
    lanes={
        "market_town": (
            "west_outer", "west_inner", "east_outer", "east_inner", "across_north", "across_south",
        ),
    },
    traffic=Traffic(cars=12, speed_mps=(0.2, 0.25)),
    lasts_s=300.0,
    agents=2,
    of_junctions=True,
    period_s=1.0,
)  # fmt: skip
