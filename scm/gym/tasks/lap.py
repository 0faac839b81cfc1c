"""Drive round as fast as one can without leaving the lane."""

from scm.gym import rewards
from scm.gym.ends import left_lane, touched, wrecked
from scm.gym.task import Start, Task, Term

TASK = Task(
    name="lap",
    about="Come as far along the lanes as possible in 60 s, alone, without leaving them.",
    maps=("driving_school", "market_town"),
    observations=("motion", "action", "lane"),
    rewards=(
        Term(rewards.progress, 1.0),
        Term(rewards.off_centre, -0.002),
        Term(rewards.steering_change, -0.01),
        Term(rewards.failed, -1.0),
    ),
    ends=(left_lane, touched, wrecked),
    start=Start(beside_m=0.02, turned_rad=0.1, speed_mps=(0.0, 0.3)),
    lasts_s=60.0,
)
