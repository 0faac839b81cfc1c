"""Arrive at green: choose a speed by what the lights will show, and never pass at red."""

from scm.gym import rewards
from scm.gym.ends import left_lane, passed_red, touched, wrecked
from scm.gym.task import Start, Task, Term

TASK = Task(
    name="green_light",
    about="Come as far as possible in 60 s without standing at lights, and pass none at red.",
    maps=("driving_school", "market_town"),
    observations=("motion", "action", "lane", "signals"),
    rewards=(
        Term(rewards.progress, 1.0),
        Term(rewards.standing, -0.005),
        Term(rewards.throttle_change, -0.002),
        Term(rewards.steering_change, -0.01),
        Term(rewards.failed, -1.0),
    ),
    ends=(left_lane, passed_red, touched, wrecked),
    start=Start(beside_m=0.01, turned_rad=0.05, speed_mps=(0.0, 0.25)),
    lasts_s=60.0,
)
