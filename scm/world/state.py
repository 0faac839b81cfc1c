"""The values of `World`, grouped by the stage that uses them."""

from dataclasses import dataclass, field

from scm.arrays import Floats
from scm.records.city_map import Point
from scm.vehicles.bank import Bank
from scm.vehicles.external_vehicles import ExternalVehicles
from scm.vehicles.rays.grid import WallGrid
from scm.world.alerts import WarningState
from scm.world.cam_triggers import CamTriggers
from scm.world.channel_load import ChannelLoad
from scm.world.radio import DelayQueue, Radio, RadioCounts, Receivers
from scm.world.vehicle_arrays import Numbers


@dataclass(slots=True)
class RadioState:
    """The radio of the city.

    Attributes:
        link: Decides which frames reach everybody except the drivers of hosted cars.
        load: How busy the channel is.
        cams: When hosted cars must send a CAM.
        roadside: Where the roadside units stand, by station.
        units: These as receivers.
        in_flight: Frames that arrive later.
        published: The counts at the last `RadioStatus`.
        warnings: Warnings on the air.
    """

    link: Radio
    load: ChannelLoad
    cams: CamTriggers
    roadside: dict[str, Point]
    units: Receivers
    in_flight: DelayQueue = field(default_factory=DelayQueue)
    published: RadioCounts = field(default_factory=RadioCounts)
    warnings: WarningState = field(default_factory=WarningState)


@dataclass(slots=True)
class SensorState:
    """The sensors of all cars.

    Attributes:
        banks: The devices of all cars, by kind of sensor.
        readings: By kind and vehicle index the newest reading, NaN before the first; no LIDARs.
        external: Where the remote cars are, for their LIDARs: only the world can see for them.
        walls: What LIDARs see of the map.
    """

    banks: dict[str, Bank]
    readings: dict[str, Floats]
    external: ExternalVehicles
    walls: WallGrid

    def remove(self, index: int) -> None:
        """Remove the devices of a car."""
        for bank in self.banks.values():
            bank.unfit(index)
        for values in self.readings.values():
            values[index] = float("nan")


@dataclass(slots=True)
class Identities:
    """What tells cars apart.

    Attributes:
        tags: The numbers of the tags on their roofs.
        highest_epoch: Of any car that left: a newcomer's is higher, whatever its name.
        unnamed: How many names of the form `n1` are known to be in use.
        scanners: How many LIDARs have come.
    """

    tags: Numbers
    highest_epoch: int = 0
    unnamed: int = 0
    scanners: int = 0
