"""The same cars as rigid bodies of PyBullet, whose wheels touch the floor with dry friction.

A chassis, two knuckles that steer and four wheels that spin, as URDF made of the numbers. Bullet
finds the contacts and their forces: wheels give way under load as springs and hold the floor by
Coulomb's friction, without slip up to its limit. Its hinges hold the steering, its motors' limits
are the wheels' dry friction. Needs `pip install pybullet`.
"""

import math
import tempfile

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from tests.reality import motion
from tests.reality.engine import Engine, kernel, see
from tests.reality.motion import ROW_S, TYRE_STIFFNESS
from tests.reality.numbers import GRAVITY

STEP_S = 0.00125
STICKS = 0.01  # slip in the car's file of most grip: the least that is allowed
KNUCKLE = 1e-3  # kg; of a wheel's mass
CAR = """<robot name="car"><link name="body"><inertial><origin xyz="{at}"/><mass value="{mass}"/>
<inertia ixx="{roll}" iyy="{pitch}" izz="{yaw}" ixy="0" ixz="0" iyz="0"/></inertial></link>
{wheels}</robot>"""
KNUCKLED = """<link name="knuckle{i}"><inertial><mass value="{light}"/>
<inertia ixx="{small}" iyy="{small}" izz="{small}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="steer{i}" type="continuous"><parent link="body"/><child link="knuckle{i}"/>
<origin xyz="{place}"/><axis xyz="0 0 1"/></joint>"""
WHEELED = """<link name="wheel{i}"><inertial><mass value="{mass}"/>
<inertia ixx="{across}" iyy="{spin}" izz="{across}" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="{radius}"/></geometry></collision></link>
<joint name="spin{i}" type="continuous"><parent link="{on}"/><child link="wheel{i}"/>
<origin xyz="{at}"/><axis xyz="0 1 0"/></joint>"""


def _places(n):
    """Return the middle of each wheel, of the centre of gravity, (4, 3)."""
    return np.array([
        ((n["base"] if k < 2 else 0.0) - n["cog"], n["track"] * (0.5 - k % 2),
         n["radius"] - n["height"])
        for k in range(4)
    ])  # fmt: skip


def _loads(n):
    """Return what each wheel carries at rest [N]."""
    front = 0.5 * n["mass"] * GRAVITY * n["cog"] / n["base"]
    rear = 0.5 * n["mass"] * GRAVITY - front
    return np.array((front, front, rear, rear))


def _car(n):
    """Return the URDF of a car whose origin is its centre of gravity, and its chassis's place."""
    hub, places, wheels = n["hub"], _places(n), []
    for i, place in enumerate(places):
        at, on, mass = " ".join(map(str, place)), "body", hub
        if i < 2:
            wheels.append(KNUCKLED.format(i=i, light=KNUCKLE, small=1e-6, place=at))
            at, on, mass = "0 0 0", f"knuckle{i}", hub - KNUCKLE
        wheels.append(WHEELED.format(
            i=i, mass=mass, across=0.5 * n["spin_inertia"], spin=n["spin_inertia"],
            radius=n["radius"], on=on, at=at,
        ))  # fmt: skip
    chassis = n["mass"] - 4.0 * hub
    at, squares = -hub * places.sum(axis=0) / chassis, hub * np.square(places).sum(axis=0)
    text = CAR.format(
        at=" ".join(map(str, at)), mass=chassis, roll=n["roll_inertia"], pitch=n["pitch_inertia"],
        yaw=n["inertia"] - squares[0] - squares[1], wheels="".join(wheels),
    )  # fmt: skip
    return text, at


@kernel()
def _act(numbers, state, wheels, loads, spins, t, throttle, steering, shake, out):
    """Advance steering and drive by one step, and lay down what they demand.

    Args:
        out: Two angles, four torques, four dry frictions, force east and north, and a moment.
    """
    c, s = numbers[0], state[0]
    motion.steer(c, s, t, motion.held(c, steering, t - c.steer_delay), motion.held(c, shake, t))
    u = motion.drive(c, s, t, motion.held(c, throttle, t - c.drive_delay))
    along, across, out[12] = motion.outside_force(c, s, t)
    slow, tan = abs(s.throttle) < 0.005, math.tan(s.angle)
    for i in range(4):
        if i < 2:
            aside = 0.5 * c.track * (1.0 if i == 0 else -1.0)
            out[i] = math.atan2(c.base * tan, c.base - aside * tan)
        wheels[i, 0] = spins[i]
        torque, damping, out[6 + i], _, current, loss = motion.turn_shaft(
            c, wheels, i, u, slow, loads[i], c.rolling
        )
        out[2 + i] = torque - damping * spins[i]
        wheels[i, 1] += c.step * spins[i]
        wheels[i, 5] = current - loss * spins[i]
    cos, sin = math.cos(s.yaw), math.sin(s.yaw)
    out[10], out[11] = cos * along - sin * across, sin * along + cos * across


class Moving(Engine):
    """A car on the floor that is driven by commands of 20 Hz; as `motion.Moving`."""

    lacks = frozenset({
        "patch_radius", "relaxation", "warm_grip", "stiffness", "slip_peak", "slip_slide",
        "side_slip_peak", "side_slip_slide",
    })  # fmt: skip
    fixed = Engine.fixed | {"tyre": "two_cubics", "combined_slip": "friction_ellipse"}
    shaping = (
        "mass", "inertia", "roll_inertia", "pitch_inertia", "base", "track", "cog", "height",
        "damper", "hub", "radius", "spin_inertia", "rotor", "side_force_peak", "grip", "slope",
        "uphill",
    )  # fmt: skip
    step_s, client = STEP_S, None

    @classmethod
    def stated(cls, numbers):
        """Return what the file of a nominal car must say of this engine's car, by file key."""
        peak = numbers["side_force_peak"]
        sticks = {
            f"tyre.{side}{name}": value
            for side in ("", "lateral_")
            for name, value in (
                ("slip_extremum", STICKS), ("force_extremum", peak),
                ("slip_asymptote", 2.0 * STICKS), ("force_asymptote", peak),
            )
        }  # fmt: skip
        return sticks | {"tyre.low_speed_m_s": 0.01, "suspension.spring_n_m": 2e5}

    def _build(self, numbers):
        before = self.client and self._now()
        self.client = self.client or BulletClient(pybullet.DIRECT)
        bullet, s, n = self.client, self.state[0], numbers
        bullet.resetSimulation()
        bullet.setTimeStep(STEP_S)
        tilt = math.atan(n["slope"])
        down = -GRAVITY * math.sin(tilt)
        bullet.setGravity(
            down * math.cos(n["uphill"]), down * math.sin(n["uphill"]), -GRAVITY * math.cos(tilt)
        )
        floor = bullet.createMultiBody(0, bullet.createCollisionShape(pybullet.GEOM_PLANE))
        bullet.changeDynamics(floor, -1, lateralFriction=1.0)
        place = (
            s["x"] + n["cog"] * math.cos(s["yaw"]), s["y"] + n["cog"] * math.sin(s["yaw"]),
            n["height"] - 0.25 * n["mass"] * GRAVITY / TYRE_STIFFNESS,
        )  # fmt: skip
        text, self.at = _car(n)
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(text)
            file.flush()
            turned = bullet.getQuaternionFromEuler((0.0, 0.0, s["yaw"]))
            self.car = bullet.loadURDF(
                file.name, place, turned, flags=pybullet.URDF_USE_INERTIA_FROM_FILE
            )
        self._shape(n)
        if before:
            self._resume(*before)
        self._look()

    def _shape(self, n):
        """Give bodies their numbers that URDF has no words for, and find the hinges."""
        bullet, count = self.client, self.client.getNumJoints(self.car)
        names = [bullet.getJointInfo(self.car, j)[1].decode() for j in range(count)]
        self.steers = [names.index(f"steer{i}") for i in range(2)]
        self.spins = [names.index(f"spin{i}") for i in range(4)]
        for j in range(-1, count):
            bullet.changeDynamics(
                self.car, j, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0,
                lateralFriction=n["grip"] * n["side_force_peak"], rollingFriction=0.0,
                spinningFriction=0.0, restitution=0.0, contactStiffness=TYRE_STIFFNESS,
                contactDamping=n["damper"],
            )  # fmt: skip
        for i, j in enumerate(self.spins):
            driven, across = i > 1 or n["front_driven"] > 0.0, 0.5 * n["spin_inertia"]
            inertia = across, n["spin_inertia"] + driven * n["rotor"], across
            bullet.changeDynamics(self.car, j, localInertiaDiagonal=inertia)
        self.loads = _loads(n)

    def _now(self):
        """Return place, turn, velocities and joints."""
        joints = self.client.getJointStates(self.car, [*self.steers, *self.spins])
        return (
            *self.client.getBasePositionAndOrientation(self.car),
            self.client.getBaseVelocity(self.car), joints,
        )  # fmt: skip

    def _resume(self, place, turned, moves, joints):
        """Go on as another car of this kind did."""
        self.client.resetBasePositionAndOrientation(self.car, place, turned)
        self.client.resetBaseVelocity(self.car, *moves)
        for j, joint in zip([*self.steers, *self.spins], joints, strict=True):
            self.client.resetJointState(self.car, j, joint[0], joint[1])

    def _fill(self, numbers):
        super()._fill(numbers)
        self.numbers["slope"] = 0.0  # gravity itself is tilted

    def _look(self):
        """Fill our own state, with place and velocity of the centre of gravity."""
        (x, y, z), (i, j, k, w) = self.client.getBasePositionAndOrientation(self.car)
        velocity, spin = self.client.getBaseVelocity(self.car)
        turn = np.reshape(self.client.getMatrixFromQuaternion((i, j, k, w)), (3, 3))
        arm = -turn @ self.at  # from the chassis's centre to the car's
        place = np.array((*(np.array((x, y, z)) + arm), w, i, j, k))
        moves = np.array((*(velocity + np.cross(spin, arm)), *spin))
        see(self.numbers[0], self.state[0], place, moves)
        self.place, self.moves = place[:3], moves[:2]

    def _row(self, row, out):
        steps, demand = round(ROW_S / STEP_S), np.zeros(13)
        bullet, car = self.client, self.car
        c, s = self.numbers[0], self.state[0]
        for k in range(steps):
            spins = np.array([joint[1] for joint in bullet.getJointStates(car, self.spins)])
            _act(
                self.numbers, self.state, self.wheels, self.loads, spins,
                (row * steps + k) * STEP_S, self.throttle, self.steering, self.shake, demand,
            )  # fmt: skip
            bullet.setJointMotorControlArray(
                car, self.steers, pybullet.POSITION_CONTROL, targetPositions=demand[:2],
                positionGains=(1.0, 1.0), forces=(100.0, 100.0),
            )  # fmt: skip
            bullet.setJointMotorControlArray(
                car, self.spins, pybullet.VELOCITY_CONTROL, forces=demand[6:10]
            )
            bullet.setJointMotorControlArray(
                car, self.spins, pybullet.TORQUE_CONTROL, forces=demand[2:6]
            )
            if demand[10:].any():
                world = pybullet.WORLD_FRAME
                bullet.applyExternalForce(car, -1, (*demand[10:12], 0.0), self.place, world)
                bullet.applyExternalTorque(car, -1, (0.0, 0.0, demand[12]), world)
            bullet.stepSimulation()
        before = self.moves
        self._look()
        self._note(row, out, (self.moves - before) / ROW_S, ROW_S)
        s["front_side"] = c["mass"] * out[8] * c["cog"] / c["base"]
