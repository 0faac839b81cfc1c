"""What the world remembers of warnings on the air."""

from dataclasses import dataclass, field

from scm.v2x.etsi.events import CarWarnings, DenmReceiver


@dataclass(slots=True)
class Dangers:
    """Who warns of what.

    Attributes:
        hits: What cars have hit since they last might warn of it, by name.
        braked: Slots of hosted cars that have braked hard since they last might warn of it.
        warners: What hosted cars warn of, by name.
        told: What all stations warn of.
    """

    hits: dict[str, tuple[str, ...]] = field(default_factory=dict)
    braked: set[int] = field(default_factory=set)
    warners: dict[str, CarWarnings] = field(default_factory=dict)
    told: DenmReceiver = field(default_factory=DenmReceiver)
