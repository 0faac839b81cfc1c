"""The world reports a contact of a car: what it did to the car's motion.

A remote car is to apply it; a hosted one has done so already, and others only watch.
"""

from typing import ClassVar

from scm.v2x.message import Delivery, Message


class Contact(Message, kw_only=True, frozen=True):
    """What contacts did to the centre of gravity since the last one sent, map frame.

    Attributes:
        number: Counts the contacts reported to this car, from 1; its state names the newest
            applied.
            0: a hosted car, whose report need not state it.
        dx_m: Position correction out of the overlap, and for what it drove on before it felt the
            hit; likewise `dy_m`, `dyaw_rad`.
        against: What it touched: names of cars, or `wall`.
    """

    KEY: ClassVar[str] = "v/{vehicle}/contact"
    DELIVERY: ClassVar[Delivery] = Delivery.COMMAND

    vehicle: str
    t_ns: int
    number: int = 0
    dvx_mps: float
    dvy_mps: float
    dyaw_rate_radps: float
    dx_m: float = 0.0
    dy_m: float = 0.0
    dyaw_rad: float = 0.0
    against: tuple[str, ...] = ()


MESSAGE = Contact
