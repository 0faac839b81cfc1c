"""Ask a recording's sensors about each other, before any model of the car."""

from scm.data_quality.compared import compare_all, no_witnesses
from scm.data_quality.conclusion import no_verdict
from scm.data_quality.corrected import forward_speed
from scm.data_quality.driven import command_problems
from scm.data_quality.mend import (
    Mending,
    mend_heading,
    mend_unsigned,
)
from scm.data_quality.mend_commands import mend_commands
from scm.data_quality.mend_pairs import mend_pairs
from scm.data_quality.mirrored import mirrored
from scm.data_quality.other_car import other_car
from scm.data_quality.rows import row_problems
from scm.data_quality.standing import standing_problem, stands
from scm.data_quality.stuck import stuck_problems
from scm.data_quality.suspect import from_repairs
from scm.data_quality.suspicion import Quality, Relation, Suspicion
from scm.data_quality.track import track
from scm.data_quality.unmeasured import clipped_rows, wrapped_rows
from scm.data_quality.usable import usable
from scm.data_quality.way import uncounted, ways
from scm.recording.read import Recording
from scm.vehicles.car import Car

SLOWEST_WITNESS_S = 0.3  # poses that come later do not see a car stop


def check(recording: Recording, car: Car | None = None) -> Quality:
    """Return what is wrong with a recording, or with its sensors against each other.

    Args:
        recording: Screened row by row; it is not changed, see `corrected.corrected`.
        car: Gives wheel radius, counts a turn and track; without it wheels are not compared.
    """
    state = Mending(recording)
    problems = list(row_problems(recording))
    problems += mend_heading(state)
    problems += mend_unsigned(state)
    problems += [*wrapped_rows(state), *clipped_rows(state)]
    problems += mend_pairs(state, car)
    problems += mend_commands(state, car)
    now = state.recording
    poses, found = track(now), ways(now, car)
    if poses is not None and stands(poses, found):
        problems.append(standing_problem())
        poses = None
    movement = forward_speed(poses)
    sees_stops = poses is not None and poses.period_s < SLOWEST_WITNESS_S
    clipped = [span for p in problems if p.name == "clipped" for span in p.when_s or ()]
    problems += stuck_problems(now, found, movement if sees_stops else None, clipped)
    not_own = no_witnesses(problems)
    found = [way for way in found if not not_own.intersection((*way.channels, way.name))]
    problems += command_problems(now, movement, poses, car)
    relations: list[Relation] = []
    suspicions: list[Suspicion] = []
    if poses is not None:
        relations, suspicions = compare_all(now, car, poses, found, problems)
    suspicions += from_repairs(state.repairs)
    if car is not None:
        problems += uncounted(now, car)
    if car is not None and movement is not None and poses is not None:
        others = list(other_car(now, car, movement, poses, relations))
        if others:  # its wheels count otherwise, no unit is wrong
            problems = [p for p in problems if not (p.name == "unit" and p.channel == "encoder.*")]
        problems += others
    suspicions.sort(key=lambda s: -s.sigma)
    backwards = mirrored(problems)
    if backwards is not None:
        problems.append(backwards)
    can_use = usable(now, problems, car)
    if not can_use.can_diagnose:
        problems.insert(0, no_verdict(can_use.lacks, relations, suspicions))
    return Quality(
        problems=tuple(problems),
        suspicions=tuple(suspicions),
        usable=can_use,
        repairs=tuple(state.repairs),
        relations=tuple(relations),
    )
