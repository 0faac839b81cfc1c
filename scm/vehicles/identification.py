"""How an effect is identified from recordings: where a search begins, and the sentence it reports.

It stands in the effect's own file, so that one effect is one file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


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
        bounds: Closer than those of the parameters, by reported name.
        parameters: Reported names of those searched for; empty: all that may be fitted.
        adds: Whether its number is added to one that the car file may have already.
        also_moves: Other keys of the car file that may move with it, and how much for one unit.
        like: The effect that cancels it on a level floor: no drive there tells the two apart.
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
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    parameters: tuple[str, ...] = ()
    adds: bool = False
    also_moves: Mapping[str, float] = field(default_factory=dict)
    like: str = ""
    shared: str = ""
