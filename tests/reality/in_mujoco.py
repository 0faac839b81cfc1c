"""The same cars carried by MuJoCo: a chassis on four sprung hubs that rolls, pitches and heaves.

MuJoCo integrates the bodies, hubs with their mass and large angles among them; tyres press on the
floor as stiff springs, and what they push along and across it, what motors and servo do, are the
laws of `motion`. Needs `pip install mujoco-core`.
"""

import math

import mujoco
import numpy as np
from numba import njit

from tests.reality import motion
from tests.reality.engine import Engine, kernel, see
from tests.reality.motion import ROW_S, TYRE_DAMPING, TYRE_STIFFNESS
from tests.reality.numbers import GRAVITY

HUBS = ("fl", "fr", "rl", "rr")
MODEL = """<mujoco>
<option timestep="{step}" integrator="implicitfast" gravity="0 0 -{gravity}"/>
<worldbody><body name="car" pos="0 0 {height}"><freejoint/>
<inertial pos="{at}" mass="{mass}" diaginertia="{roll} {pitch} {yaw}"/>
{hubs}</body></worldbody></mujoco>"""
HUB = """<body pos="{x} {y} {z}"><joint type="slide" axis="0 0 1" stiffness="{spring}"
damping="{damper}" springref="{rest}"/><inertial pos="0 0 0" mass="{mass}"
diaginertia="1e-5 1e-5 1e-5"/></body>"""


def _geometry(numbers):
    """Return each hub's place from the centre of gravity and its load at rest, (4, 4)."""
    front = numbers["cog"] / numbers["base"]
    places = []
    for k in range(4):
        x = (numbers["base"] if k < 2 else 0.0) - numbers["cog"]
        y = 0.5 * numbers["track"] * (1.0 if k % 2 == 0 else -1.0)
        share = 0.5 * (front if k < 2 else 1.0 - front)
        load = share * numbers["mass"] * GRAVITY
        places.append((x, y, numbers["radius"] - numbers["height"], load))
    return np.array(places)


def _model(numbers, places):
    """Return MuJoCo's model, at rest with every spring carrying its share."""
    hub, spring = numbers["hub"], numbers["spring"]
    chassis = numbers["mass"] - 4.0 * hub
    at = -hub * places[:, :3].sum(axis=0) / chassis
    squares = hub * np.square(places[:, :3]).sum(axis=0)
    hubs = "".join(
        HUB.format(
            x=x, y=y, z=z, spring=spring, damper=numbers["damper"], mass=hub,
            rest=-(load - hub * GRAVITY) / spring,
        )
        for x, y, z, load in places
    )  # fmt: skip
    text = MODEL.format(
        step=numbers["step"], gravity=GRAVITY, height=numbers["height"], at=" ".join(map(str, at)),
        mass=chassis, roll=numbers["roll_inertia"], pitch=numbers["pitch_inertia"],
        yaw=numbers["inertia"] - squares[0] - squares[1], hubs=hubs,
    )  # fmt: skip
    return mujoco.MjModel.from_xml_string(text)


@njit(cache=True)
def _product(matrix, vector):
    """Multiply by hand: numba's own product needs SciPy, which a process may have shut out."""
    return (matrix * vector).sum(axis=1)


@kernel()
def push(numbers, state, wheels, places, qpos, qvel, forces, t, throttle, steering, shake):
    """Advance steering, drive and wheels by one step, and lay all forces on the bodies."""
    c, s = numbers[0], state[0]
    see(c, s, qpos, qvel)
    motion.steer(c, s, t, motion.held(c, steering, t - c.steer_delay), motion.held(c, shake, t))
    u = motion.drive(c, s, t, motion.held(c, throttle, t - c.drive_delay))
    along, across, twist = motion.outside_force(c, s, t)
    slow, tan = abs(s.throttle) < 0.005, math.tan(s.angle)
    cos_yaw, sin_yaw = math.cos(s.yaw), math.sin(s.yaw)
    w, x, y, z = qpos[3], qpos[4], qpos[5], qpos[6]
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    spin = _product(turn, qvel[3:6])
    total = np.array([cos_yaw * along - sin_yaw * across, sin_yaw * along + cos_yaw * across, 0.0])
    torque = np.array([0.0, 0.0, twist])
    s.front_side = 0.0
    for i in range(4):
        arm = _product(turn, places[i, :3] + np.array([0.0, 0.0, qpos[7 + i]]))
        rise = qvel[2] + spin[0] * arm[1] - spin[1] * arm[0] + qvel[6 + i] * turn[2, 2]
        squeeze = c.radius - (qpos[2] + arm[2])
        load = max(places[i, 3] + TYRE_STIFFNESS * squeeze - TYRE_DAMPING * rise, 0.0)
        down = np.array([arm[0], arm[1], -qpos[2]])
        v_e = qvel[0] + spin[1] * down[2] - spin[2] * down[1]
        v_n = qvel[1] + spin[2] * down[0] - spin[0] * down[2]
        bend, aside = s.yaw, places[i, 1]
        if i < 2:
            bend += math.atan2(c.base * tan, c.base - aside * tan)
        cos, sin = math.cos(bend), math.sin(bend)
        on = motion.inside_patch(c, qpos[0] + arm[0], qpos[1] + arm[1])
        f_long, f_lat = motion.spin_wheel(
            c, wheels, i, u, slow, load, c.grip * (1.0 + (c.patch_grip - 1.0) * on),
            cos * v_e + sin * v_n, cos * v_n - sin * v_e, c.rolling + c.patch_rolling * on,
        )  # fmt: skip
        force = np.array([cos * f_long - sin * f_lat, sin * f_long + cos * f_lat, load])
        total += force
        torque += np.cross(down, force)
        forces[6 + i] = turn[0, 2] * force[0] + turn[1, 2] * force[1] + turn[2, 2] * force[2]
        s.front_side += f_lat if i < 2 else 0.0
    forces[:3] = total
    forces[3:6] = _product(turn.T, torque)


class Moving(Engine):
    """A car on the floor that is driven by commands of 20 Hz; as `motion.Moving`."""

    shaping = (
        "mass", "inertia", "roll_inertia", "pitch_inertia", "base", "track", "cog", "height",
        "spring", "damper", "hub", "radius", "step",
    )  # fmt: skip
    data = None

    def _build(self, numbers):
        before, s = self.data, self.state[0]
        self.places = _geometry(numbers)
        self.model = _model(numbers, self.places)
        self.data = mujoco.MjData(self.model)
        if before is not None:
            self.data.qpos[:], self.data.qvel[:] = before.qpos, before.qvel
        else:
            yaw = 0.5 * s["yaw"]
            self.data.qpos[3:7] = math.cos(yaw), 0.0, 0.0, math.sin(yaw)
        cos, sin = math.cos(s["yaw"]), math.sin(s["yaw"])
        self.data.qpos[:2] = s["x"] + numbers["cog"] * cos, s["y"] + numbers["cog"] * sin

    def _row(self, row, out):
        qpos, qvel, forces = self.data.qpos, self.data.qvel, self.data.qfrc_applied
        step = self.model.opt.timestep
        steps = round(ROW_S / step)
        for k in range(steps):
            before = qvel[:2].copy()
            t = (row * steps + k) * step
            push(
                self.numbers, self.state, self.wheels, self.places, qpos, qvel, forces, t,
                self.throttle, self.steering, self.shake,
            )  # fmt: skip
            mujoco.mj_step(self.model, self.data)
        see(self.numbers[0], self.state[0], qpos, qvel)
        self._note(row, out, (qvel[:2] - before) / step, step)
