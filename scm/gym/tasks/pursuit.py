"""Pursue: follow another car at close distance, wherever it drives, without touching it."""

from scm.gym import rewards
from scm.gym.ends import lost, touched, wrecked
from scm.gym.task import Start, Task, Term, Traffic

TASK = Task(
    name="pursuit",
    about="Follow a car that rules drive at close distance for 60 s, without touching it.",
    maps=("driving_school", "market_town"),
    observations=("motion", "action", "pursued"),
    rewards=(
        Term(rewards.close, 0.02),
        Term(rewards.too_far, -0.02),
        Term(rewards.steering_change, -0.01),
        Term(rewards.failed, -1.0),
    ),
    ends=(lost, touched, wrecked),
    start=Start(beside_m=0.01, turned_rad=0.05, speed_mps=(0.0, 0.2), gap_m=(0.5, 1.0)),
    traffic=Traffic(cars=1, speed_mps=(0.1, 0.24)),
    lasts_s=60.0,
)
