"""Park: drive to a bay without touching anything, and stand there."""

from scm.gym import rewards
from scm.gym.ends import parked, touched, wrecked
from scm.gym.task import PlaceStart, Task, Term

SCHOOLS = ("parking_school", "parking_school_obstacles")

TASK = Task(
    name="parking",
    about="Drive to a bay and stand there as a car that parks itself has to, within 30 s.",
    maps=(*SCHOOLS, "parking_lot"),
    observations=("motion", "action", "goal", "ranges_36"),
    rewards=(
        Term(rewards.goal_progress, 1.0),
        Term(rewards.goal_turn_progress, 0.2),
        Term(rewards.steering_change, -0.01),
        Term(rewards.parked, 1.0),
        Term(rewards.contact, -1.0),
    ),
    ends=(parked, touched, wrecked),
    start=PlaceStart(
        places=dict.fromkeys(SCHOOLS, ("start", "a", "b", "c")),
        goals=dict.fromkeys(SCHOOLS, ("goal",)),
        aside_m=0.1,
        turned_rad=0.3,
    ),
    lasts_s=30.0,
)
