"""Changes of the kernel's and the rings' source, each of which a proof must catch.

Each is (what stands there, what stands there instead); the first occurs exactly once.
"""

import types
from pathlib import Path


def mutant_of(module, old, new):
    """Return the module with one place of its source changed."""
    source = Path(module.__file__).read_text(encoding="utf-8")
    assert source.count(old) == 1, old
    mutant = types.ModuleType("mutant")
    exec(compile(source.replace(old, new), "mutant", "exec"), mutant.__dict__)
    return mutant


KERNEL = {
    "all-red left out": (
        "return GroupState(Phase.CLEARANCE)\n        case Phase.CLEARANCE",
        "return GroupState(Phase.RED)\n        case Phase.CLEARANCE",
    ),
    "all-red too short": ("elapsed >= times.clearance", "True"),
    "all-red does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW)",
    ),
    "yellow does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.GREEN, Phase.CLEARANCE)",
    ),
    "green does not guard": (
        "_ACTIVE = (Phase.GREEN, Phase.YELLOW, Phase.CLEARANCE)",
        "_ACTIVE = (Phase.YELLOW, Phase.CLEARANCE)",
    ),
    "min green ignored": ("elapsed >= times.min_green:", "True:"),
    "yellow too short": ("elapsed >= times.yellow", "True"),
    "yellow as short as all-red": ("elapsed >= times.yellow", "elapsed >= times.clearance"),
    "yellow skipped": ("else GroupState(Phase.YELLOW)", "else GroupState(Phase.CLEARANCE)"),
    "conflicts ignored": ("in program.conflicts", "in ()"),
    "two start at once": ("_is_free(program, after, name)", "_is_free(program, list(state), name)"),
    "flash ends without clearing": (
        "case Phase.FLASH:\n            return GroupState(Phase.CLEARANCE)",
        "case Phase.FLASH:\n            return GroupState(Phase.RED)",
    ),
    "power-on without clearing": (
        "return tuple(GroupState(Phase.CLEARANCE) for _",
        "return tuple(GroupState(Phase.RED) for _",
    ),
    "green that nobody requested": ("is Phase.RED and name in requested and", "is Phase.RED and"),
    "never green": (
        "is Phase.RED and name in requested",
        "is Phase.RED and name not in program.groups",
    ),
    "flash ignored": ("if flash:", "if flash and not state:"),
    "time not counted": (
        "else GroupState(group.phase, elapsed)",
        "else GroupState(group.phase, group.elapsed)",
    ),
    "a green never ends": ("if is_requested else", "if True else"),
    "all-red one step short": ("elapsed >= times.clearance", "elapsed + 1 >= times.clearance"),
    "yellow one step short": ("elapsed >= times.yellow", "elapsed + 1 >= times.yellow"),
    "min green one step short": ("elapsed >= times.min_green:", "elapsed + 1 >= times.min_green:"),
}

RINGS = {
    "no barrier": (
        "if all(ready) and all(is_last) and",
        "if any(ready) and any(is_last) and",
    ),
    "no max": ("or ring.waited >= _most(times, ring.phase, inputs)", "or False"),
    "max does not run": ("waited=min(ring.waited + dt,", "waited=min(ring.waited,"),
    "max runs for nobody else": (
        "return bool(conflicting - {phase})",
        "return not conflicting - {phase}",
    ),
    "others in the ring not seen": ("if phase not in ring:", "if True:"),
    "no gap-out and no max": ("and is_over and", "and False and"),
    "min green endless": ("green=min(ring.green + dt, times.min_green)", "green=0"),
    "ring goes back": ("for i in sequence[at + 1 :] if", "for i in sequence if"),
    "ring stays where it was": (
        "return ring if following is None else",
        "return ring if True else",
    ),
    "never crosses": ("if others:\n        after", "if others and not state:\n        after"),
    "first section only": (
        "for section in ((state.section + ahead)",
        "for section in ((0 + ahead)",
    ),
    "begins again before the barrier": (
        "if following is None and wraps:",
        "if following is None:",
    ),
    "never begins again": ("if following is None and wraps:", "if following is None and False:"),
    "calls not heard": (
        "called = (inputs.calls | state.calls | always)",
        "called = (state.calls | always)",
    ),
    "all in one ring side by side": (
        "rings = _components(members, conflicting)",
        "rings = tuple((i,) for i in members)",
    ),
    "friends are conflicting": (
        "if j not in conflicting[i] and j != i} for i in numbers}",
        "if j != i} for i in numbers}",
    ),
    "odd conflicts not cut into stages": (
        "if all(j in conflicting[i] for ring in rings for i in ring for j in ring if i != j):",
        "if rings:",
    ),
    "requests all that is called": (
        "return frozenset(ring.phase for ring in state.rings if ring.phase is not None)",
        "return frozenset(range(2))",
    ),
}

RINGS_WITH_INPUTS = {
    "crosses to where nobody waits": (
        "if any(i in called for ring in layout.sections[section] for i in ring)",
        "if layout.sections[section]",
    ),
    "hold ignored": ("is_over and ring.phase not in inputs.hold", "is_over"),
    "hold shuts the ring beside it": ("wraps=is_shut or not others", "wraps=not others"),
    "omit ignored": ("| always) - inputs.omit\n", "| always)\n"),
    "omit too late": ("is_left_out = ring.phase in inputs.omit", "is_left_out = False"),
    "omit loses the place": ("Ring(None, passed=ring.phase)", "Ring(None)"),
    "omit opens the barrier": (
        "_place(ring) is None or following",
        "ring.phase is None or following",
    ),
    "pre-emption ignored": ("if inputs.preempt is not None:", "if inputs.preempt == 99:"),
    "pre-emption waits for its turn": (
        "if inputs.preempt is not None:",
        "if inputs.preempt is not None and not state.rings[0].green:",
    ),
    "pre-emption drags others along": (
        "else tuple(Ring() for _ in sequences)",
        "else tuple(Ring(sequence[0]) for sequence in sequences)",
    ),
    "pre-emption never ends": ("return _go_on(layout, state, inputs, called)", "return state"),
    "force-off holds": (
        "or ring.phase in inputs.force_off",
        "and ring.phase not in inputs.force_off",
    ),
    "no max while max 2 is told": (
        "or ring.waited >= _most(times, ring.phase, inputs)",
        "or (ring.waited >= times.max1 and not inputs.max2)",
    ),
}
