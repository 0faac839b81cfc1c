"""Drive along the lanes among cars that rules drive, without leaving the lane or touching them."""

from scm.gym import rewards
from scm.gym.ends import left_lane, touched, wrecked
from scm.gym.task import Start, Task, Term, Traffic

TASK = Task(
    name="traffic",
    about="Come as far along the lanes as possible in 60 s, in a row of cars that rules drive.",
    maps=("driving_school", "market_town"),
    observations=("motion", "action", "lane", "ahead"),
    rewards=(
        Term(rewards.progress, 1.0),
        Term(rewards.off_centre, -0.002),
        Term(rewards.steering_change, -0.01),
        Term(rewards.failed, -1.0),
    ),
    ends=(left_lane, touched, wrecked),
    start=Start(beside_m=0.01, turned_rad=0.05, speed_mps=(0.0, 0.2), gap_m=(0.6, 1.0), behind=1),
    traffic=Traffic(cars=3, speed_mps=(0.08, 0.22)),
    lasts_s=60.0,
)
