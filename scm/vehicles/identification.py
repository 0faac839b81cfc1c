"""How an effect is identified from recordings: where a search begins, and the sentence it reports.

It stands in the effect's own file, so that one effect is one file.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from scm.arrays import Floats


@dataclass(frozen=True, slots=True)
class Line:
    """What a faulty sensor is off by, as a report draws it.

    Attributes:
        of: Returns the error from what it depends on, and the fault's number.
    """

    x_name: str
    x_unit: str
    y_name: str
    y_unit: str
    of: Callable[[Floats, float], Floats]


@dataclass(frozen=True, slots=True)
class Identification:
    """What a search for missing physics needs to know of an effect.

    Attributes:
        equation: Part of the model: `drive`, `steering`, `tyre`, `body`, `surface` or `sensor`.
        depends_on: Physical variables, such as `("speed",)`.
        starts: Values of its parameters to begin from, in their order.
        steps: A change of each parameter that shows, for derivatives.
        sentence: For a mechanic; braces take the parameters by their reported names.
        rare: What it must gain beyond others [squared std]: it looks like something more common.
        needs_mps, needs_m_s2: Speed and side acceleration that a drive must reach to show it.
        needs_odometer: Whether only an odometer shows it.
        needs_distance: Whether only a measure of distance beside the poses shows it.
        bounds: Closer than those of the parameters, by reported name.
        parameters: Reported names of those searched for; empty: all that may be fitted.
        adds: Whether its number is added to one that the car file may have already.
        stays_above: A car's own number that it is added to; the sum stays above 0.
        also_moves: Other keys of the car file that may move with it, and how much for one unit.
        like: The effect that cancels it on a level floor: no drive there tells the two apart.
        why_alike: A sentence on that, in one of the two.
        own: A car's own number that means the same as its first parameter.
        only_with: An effect of the car without which this one is not searched for.
        experiments: By name, those with more than a drive that make sense for some effects only.
        advice: What a mechanic does about it: check, repair, or record.
        turns: Whether it is drawn as an angle of the wheels, as all of steering and tyres are.
        varies: Whether its one number may depend on a variable, such as the throttle.
        line: How a sensor's fault is drawn.
        shared: What several cars may share of it: `camera`, `tags` or `floor`.
    """

    equation: str
    depends_on: tuple[str, ...]
    starts: tuple[tuple[float, ...], ...]
    steps: tuple[float, ...]
    sentence: str
    rare: float = 0.0
    needs_mps: float = 0.0
    needs_m_s2: float = 0.0
    needs_odometer: bool = False
    needs_distance: bool = False
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    parameters: tuple[str, ...] = ()
    adds: bool = False
    stays_above: str = ""
    also_moves: Mapping[str, float] = field(default_factory=dict)
    like: str = ""
    why_alike: str = ""
    own: str = ""
    only_with: str = ""
    experiments: tuple[str, ...] = ()
    advice: str = ""
    shared: str = ""
    turns: bool = False
    varies: bool = False
    line: Line | None = None
