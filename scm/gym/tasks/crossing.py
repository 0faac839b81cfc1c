"""Cross junctions without lights: cars that know of each other by radio alone."""

from scm.gym import rewards
from scm.gym.ends import left_lane, touched, wrecked
from scm.gym.task import Start, Task, Term

TASK = Task(
    name="crossing",
    about="Come as far as possible in 60 s, four cars that cross each other's way without lights.",
    maps=("driving_school", "market_town"),
    observations=("motion", "action", "lane", "others"),
    rewards=(
        Term(rewards.progress, 1.0),
        Term(rewards.steering_change, -0.01),
        Term(rewards.failed, -1.0),
    ),
    ends=(left_lane, touched, wrecked),
    start=Start(beside_m=0.01, turned_rad=0.05),
    lasts_s=60.0,
    agents=4,
)
