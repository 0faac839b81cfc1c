"""The part that drives one car by a policy: what it knows of itself comes in, actions go out."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scm.arrays import Floats
from scm.clock import nanoseconds, seconds
from scm.errors import ScmError
from scm.records.policy import SPEED_CURVATURE
from scm.runtime.part import Subscription
from scm.v2x.exchange import Incoming
from scm.v2x.messages.lidar_scan import LidarScan
from scm.v2x.messages.vehicle_sensors import VehicleSensors
from scm.v2x.messages.vehicle_state import VehicleState
from scm.v2x.messages.world_definition import WorldDefinition
from scm.vehicles.car import load_car
from scm.vehicles.drivers.limits import limits_of
from scm.vehicles.drivers.speed_curvature import SpeedCurvatureController
from vehicle_agent.autonomy.control import Command
from vehicle_agent.policy.model import Policy
from vehicle_agent.policy.senses import NOWHERE, Aim, Senses, counts_of
from vehicle_agent.trained_driver import STAND, TrainedDriver


class PolicyPart(TrainedDriver):
    """A policy that drives one car.

    Args:
        name: Its station, which owns the lease.
        vehicle: The car.
        model: Path of the policy.
        spawn: Place at which the car is put onto the map first, empty: any free one; None: it is
            there.
        session: Of its bus.
        ignore_signals: Whether it drives on whatever they show.
        aim: Where it is to drive; a car that is parked at its goal stands from then on.

    Attributes:
        actions: How many it took.
        is_parked: Whether it stands at its goal.

    Raises:
        LearningError: when the policy cannot be used.
    """

    def __init__(
        self, name: str, vehicle: str, model: Path, spawn: str | None = None, session: str = "",
        *, ignore_signals: bool = False, aim: Aim = NOWHERE,
    ) -> None:  # fmt: skip
        self.policy = Policy(model)
        counts_of(self.policy.metadata, aim)
        car = self.policy.metadata.car
        super().__init__(name, vehicle, car, spawn, session, ignore_signals=ignore_signals)
        self._period_ns = nanoseconds(self.policy.metadata.period_s)
        own = {"vehicle": vehicle}
        sensed = Subscription(VehicleSensors, own), Subscription(LidarScan, own)
        self.subscriptions = (*self.subscriptions, *sensed)
        self._senses: Senses | None = None
        self._controller = (
            SpeedCurvatureController(limits_of(load_car(car)), 1)
            if self.policy.metadata.actions == SPEED_CURVATURE
            else None
        )
        self._speed_mps = 0.0
        self._acted_ns, self._action = -self._period_ns, STAND
        self.actions, self.is_parked, self._aim = 0, False, aim

    def learn(self, world: WorldDefinition) -> None:
        """Follow the lanes of another map."""
        super().learn(world)
        try:
            self._senses = Senses(self.policy.metadata, world.map, self._vehicle, self._aim)
        except ScmError as error:
            self._senses = None
            self.refuse(str(error))

    def look(self, inbox: Sequence[Incoming], now_ns: int) -> Command | None:
        """Act once a period, by the newest that the car knows of itself."""
        if self._senses is None:
            return None
        for item in inbox:
            self._senses.receive(item)
        states = [item.message for item in inbox if isinstance(item.message, VehicleState)]
        if not states or now_ns - self._acted_ns < self._period_ns:
            return None
        self._speed_mps = states[-1].speed_mps
        self.is_parked = self.is_parked or self._senses.is_parked(states[-1])
        if self.is_parked:
            return STAND
        seen = self._senses.look(states[-1], self._action, now_ns)
        if seen is None:
            self._begin_anew()
            return STAND
        passed_s = seconds(now_ns - self._acted_ns)
        self._acted_ns, self.actions = now_ns, self.actions + 1
        self._action = self._command_for(self.policy(seen), passed_s)
        return self._action

    def allowed(self, now_ns: int) -> Command:
        """Return the command with the throttle that signals allow."""
        allowed = super().allowed(now_ns)
        if allowed.throttle < self._action.throttle:
            self._begin_anew()
        return allowed

    def _command_for(self, action: Floats, passed_s: float) -> Command:
        """Return the command for an action (2,), a time after the one before."""
        if self._controller is not None:
            speed = np.array([self._speed_mps])
            (action,) = self._controller.commands(action[None], speed, passed_s)
        return Command(*action.tolist())

    def _begin_anew(self) -> None:
        """Let the controller go on from the car's speed: it does not do what was commanded."""
        if self._controller is not None:
            self._controller.begin(np.zeros(1, np.int64), np.array([self._speed_mps]))

    def detail(self) -> str:
        """Return how it drives, or what it waits for, in words."""
        if self.is_parked:
            return f"{self._vehicle} is parked at {self._aim.goal}"
        if self._senses is not None and self._senses.missing:
            return f"{self._vehicle} stands: it waits for {self._senses.missing}"
        return f"{self.actions} actions" if self.actions else f"waits for {self._vehicle}"
