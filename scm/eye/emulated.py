"""Emulated real cars, for the emulated camera: it sees them where they are, not where they say.

A real car's place in the world's snapshot is what its own program claims. An emulated one tells
the truth besides, and that is drawn, so that its program finds out only by looking.
"""

import msgspec

from scm.clock import NS_PER_S, seconds
from scm.geometry import Pose2
from scm.v2x.messages.emulated_pose import EmulatedPose
from scm.v2x.messages.world_snapshot import SnapshotVehicle, WorldSnapshot

GONE_NS = NS_PER_S
"""Who has told nothing for so long was taken off the floor."""
FAR_M = 1000.0


class EmulatedCars:
    """What emulated cars have told of themselves."""

    def __init__(self) -> None:
        self._newest: dict[str, EmulatedPose] = {}

    def hear(self, told: EmulatedPose) -> None:
        """Remember where a car is; what lies beyond all maps is not believed."""
        if max(abs(told.x_m), abs(told.y_m)) < FAR_M:
            self._newest[told.vehicle] = told

    def seen(self, light: WorldSnapshot) -> WorldSnapshot:
        """Return the city as there is to see of it.

        Only real cars can be emulated ones. Those that the city does not know yet are seen if they
        know their own tag.
        """
        if not self._newest:
            return light
        there = {name: told for name, told in self._newest.items()
                 if abs(light.t_ns - told.t_ns) < GONE_NS}  # fmt: skip
        known = {car.vehicle for car in light.vehicles}
        cars = []
        for car in light.vehicles:
            if car.kind != "real" or car.vehicle not in self._newest:
                cars.append(car)
            elif car.vehicle in there:
                cars.append(_drawn(there[car.vehicle], car.tag_id, light.t_ns))
        cars += [_drawn(told, told.tag_id, light.t_ns) for name, told in there.items()
                 if name not in known and told.tag_id is not None]  # fmt: skip
        return msgspec.structs.replace(light, vehicles=tuple(cars))


def _drawn(told: EmulatedPose, tag_id: int, t_ns: int) -> SnapshotVehicle:
    """Return a car as it stands at an instant; the published firmware has no lights."""
    pose = _carried(told, seconds(t_ns - told.t_ns))
    return SnapshotVehicle(
        vehicle=told.vehicle,
        kind="real",
        car=told.car,
        tag_id=tag_id if told.tag_id is None else told.tag_id,
        x_m=pose.x,
        y_m=pose.y,
        yaw_rad=pose.yaw,
        speed_mps=told.speed_mps,
        steering_rad=told.steering_rad,
    )


def _carried(told: EmulatedPose, dt_s: float) -> Pose2:
    """Return the pose some milliseconds later or earlier, on along its arc."""
    turned = told.yaw_rate_radps * dt_s
    half = Pose2(0.0, 0.0, turned / 2.0)
    forth = Pose2(told.speed_mps * dt_s, told.lateral_speed_mps * dt_s, 0.0)
    return Pose2(told.x_m, told.y_m, told.yaw_rad) @ half @ forth @ half
