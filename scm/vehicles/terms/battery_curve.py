"""Battery curve: a lithium-polymer pack's voltage without load falls with its charge.

    open_circuit_voltage = cells * U(start_charge - charge_drawn / capacity)    [V]

U is `lipo.cell_voltage`, 3.27 V empty to 4.20 V full. Takes the place of the voltage given from
outside; without `battery_charge` nothing is drawn and it stays where it starts.
Holds: rested cells at room temperature, +-20 mV a cell.   Shows in: top speed over a charge.
Source: the rest-voltage chart of LiPo cells printed by their makers.
"""

from scm.vehicles.jit import kernel_function
from scm.vehicles.lipo import pack_voltage
from scm.vehicles.param import LogNormal, Param
from scm.vehicles.term import Per, Term


@kernel_function
def battery_curve(charge_drawn: float, cells: float, capacity: float, start_charge: float) -> float:
    """Voltage without load [V]."""
    return pack_voltage(charge_drawn, cells, capacity, start_charge)


TERM = Term(
    battery_curve,
    per=Per.BODY,
    sets="open_circuit_voltage",
    shows_in=("long_drive",),
    params=(
        Param("cells", 3.0, "1", "battery.cells", (1.0, 20.0), "in series", fit=False),
        Param("capacity", 5.2, "A*h", "drive.battery_capacity_ah", (0.01, 500.0),
              "from full to empty", LogNormal(5.2, 0.2)),
        Param("start_charge", 1.0, "1", "battery.start_charge", (0.0, 1.0), "1 is full"),
    ),
)  # fmt: skip
