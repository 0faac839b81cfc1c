"""How a four-wheeled car moves: 4 kHz, wheel spin solved implicitly, the body half explicitly.

Each wheel has its motor, load, tyre and dry friction. The body heaves, rolls and pitches a little,
on springs and dampers over tyres that press in; hubs have no mass here. Positions are those of the
floor under the middle of the rear axle. Order of wheels: front left, front right, rear left, rear
right. All numbers come as one record, so that laws read by name. Some of them choose between
equations, see `family`; the above is the usual choice.
"""

import math

import numpy as np
from numba import njit

from tests.reality.numbers import EQUATIONS, GRAVITY, KEYS, NEUTRAL

# Places in `family.ASPECTS`, of all but the equations that need no choice.
PACEJKA, FIALA = 1, 2
FRICTION_ELLIPSE, SLIP_VECTOR = 1, 2
SPRUNG, QUASI_STATIC = 0, 1
INDUCTANCE, CURRENT_LIMIT = 1, 2
FIRST_ORDER, SECOND_ORDER, LOADED = 1, 2, 3
SMOOTH, MIDPOINT = 1, 1

STEP = EQUATIONS["step"]
ROW_S, COMMAND_S = STEP * 10, EQUATIONS["command"]
TYRE_STIFFNESS, TYRE_DAMPING = 2.0e4, 10.0
YIELD_LAG = 0.001  # of wheels that give way: what damps a stiff rod
WARM_S = 60.0
STICTION_FADE = 0.6
CREEP = 0.002  # m/s, of smooth friction
LOAD_LAG = 0.02  # s, of loads that follow the accelerations
SERVO_DAMPING = 0.8

NUMBERS = np.dtype([(name, "f8") for name in (*KEYS, *NEUTRAL, *EQUATIONS)])
STATE = np.dtype(
    [
        (name, "f8")
        for name in (
            "x", "y", "yaw", "vx", "vy", "yaw_rate", "throttle", "target", "servo", "linkage",
            "angle", "yielded", "push", "side", "front_side", "heave", "heave_rate", "roll",
            "roll_rate", "pitch", "pitch_rate", "servo_rate", "load_push", "load_side", "warmth",
        )
    ]
)  # fmt: skip
ROW = ("t", "x", "y", "yaw", "vx", "vy", "yaw_rate", "push", "side", "left", "right")
WHEEL = ("spin", "turned", "strength", "lag", "squeeze", "torque")


@njit(cache=True)
def curve(tyre, q, shape, bend):
    """Tyre force over its peak, of slip over that of the two cubics' peak; `q` above zero."""
    if tyre == PACEJKA:
        stiff = 1.5 / shape * q
        return math.sin(shape * math.atan(stiff - bend * (stiff - math.atan(stiff))))
    if tyre == FIALA:
        return 1.0 - max(1.0 - shape * q / 3.0, 0.0) ** 3
    sticks = max(1.0 - 0.5 * q / shape, 0.0)
    slides = 1.0 - sticks * sticks * (3.0 - 2.0 * sticks)
    return 1.5 * q * sticks * sticks + bend * slides


@njit(cache=True)
def over_slip(c, slip, peak, force_peak, slide, force_slide, shape, bend):
    """Tyre force over load and over slip."""
    size = abs(slip)
    if c.tyre > 0.0:
        q = max(size / peak, 1e-4)
        return force_peak * curve(c.tyre, q, shape, bend) / (q * peak)
    if size <= peak:
        q = size / peak
        return force_peak * (1.5 - 0.5 * q * q) / peak
    p = min((size - peak) / (slide - peak), 1.0)
    return (force_peak + (force_slide - force_peak) * (3.0 - 2.0 * p) * p * p) / size


@njit(cache=True)
def inside_patch(c, x, y):
    """Share of a contact patch that lies on the spot; its edge is 2 cm wide."""
    away = math.hypot(x - c.patch_x, y - c.patch_y)
    return min(max(0.5 + (c.patch_radius - away) / 0.02, 0.0), 1.0)


@njit(cache=True)
def turn_servo(c, s):
    """Advance the servo by one step towards its target."""
    pace = c.pace * max(1.0 - c.pace_per_throttle * abs(s.throttle), 0.05)
    move, most = s.target - s.servo, c.rate * pace * c.step
    if c.servo == FIRST_ORDER:
        move *= c.step / (c.servo_lag + c.step)
    elif c.servo == SECOND_ORDER:
        pull = 2.0 * SERVO_DAMPING / c.servo_lag
        s.servo_rate += c.step * pull * (pull * move - 2.0 * SERVO_DAMPING * s.servo_rate)
        s.servo_rate = min(max(s.servo_rate, -c.rate * pace), c.rate * pace)
        move = s.servo_rate * c.step
    elif c.servo == LOADED:
        most *= max(1.0 - c.servo_load * abs(s.front_side), 0.9)
    s.servo += min(max(move, -most), most)


@njit(cache=True)
def steer(c, s, t, command, shake):
    """Advance the steering by one step; the angle of the wheels ends in `s.angle`."""
    command = min(max(command, -c.stop_right), c.stop_left)
    demand = c.limit * min(max(command, -1.0), 1.0) * c.steer_gain + c.shake * shake
    demand *= 1.0 + c.side_gain if demand > 0.0 else 1.0 - c.side_gain
    lag = c.steer_lag + (c.left_lag if demand > 0.0 else 0.0)
    s.target += (demand - s.target) * c.step / (lag + c.step)
    turn_servo(c, s)
    half = 0.5 * c.backlash
    s.linkage = min(max(s.linkage, s.servo - half), s.servo + half)
    angle = s.linkage + c.trim + c.steer_per_speed * s.vx
    angle += c.weave * math.sin(2.0 * math.pi * t / c.weave_period)
    angle -= c.understeer * s.vx * s.yaw_rate
    gives = c.give * s.front_side / (c.mass * GRAVITY)
    s.yielded += c.step / (YIELD_LAG + c.step) * (gives - s.yielded)
    s.angle = angle - s.yielded


@njit(cache=True)
def drive(c, s, t, command):
    """Advance the drive's command by one step; return the throttle that the motors get."""
    u = command - min(max(command, -c.drive_deadband), c.drive_deadband)
    u *= c.drive_gain
    lag = c.drive_lag + (c.rising_lag if abs(u) > abs(s.throttle) else 0.0)
    s.throttle += (u - s.throttle) * c.step / (lag + c.step)
    s.warmth += (abs(command) - s.warmth) * c.step / (c.warm_s + c.step)
    u = s.throttle * max(0.0, 1.0 - c.sag * t / 60.0)
    u *= 1.0 + c.surge * math.sin(2.0 * math.pi * t / c.surge_period)
    return u * (1.0 - c.brake_weak) if u < 0.0 else u


@njit(cache=True)
def outside_force(c, s, t):
    """Forces on the body along and across [N], and a moment [N*m], that no wheel gives."""
    speed = math.hypot(s.vx, s.vy)
    drag = c.drag_linear + c.drag_square * speed
    along = -drag * s.vx - c.corner_drag * c.mass * abs(s.yaw_rate) * s.vx
    across = -drag * s.vy
    twist = -c.drag_turn * s.yaw_rate + c.twist_per_speed * s.vx
    cos, sin = math.cos(s.yaw), math.sin(s.yaw)
    down = c.mass * GRAVITY * c.slope / math.sqrt(1.0 + c.slope * c.slope)
    gust = c.gust * math.sin(2.0 * math.pi * t / c.gust_period + c.gust_phase)
    east = c.wind_x - down * math.cos(c.uphill) + gust * math.cos(c.gust_way)
    north = c.wind_y - down * math.sin(c.uphill) + gust * math.sin(c.gust_way)
    east -= c.pull * (s.x - c.pull_x)
    north -= c.pull * (s.y - c.pull_y)
    half = s.x * math.cos(c.half_way) + s.y * math.sin(c.half_way) > c.half_at
    tilted = c.mass * GRAVITY * c.half_slope * half
    east -= tilted * math.cos(c.half_uphill)
    north -= tilted * math.sin(c.half_uphill)
    twist += c.swirl * (math.hypot(s.x - c.swirl_x, s.y - c.swirl_y) < c.swirl_radius)
    along += cos * east + sin * north
    across += cos * north - sin * east
    way = math.tanh(s.vx / 0.02)
    extra = c.nap * 0.5 * (1.0 + math.cos(s.yaw - c.nap_way))
    place = s.x * math.cos(c.tile_way) + s.y * math.sin(c.tile_way)
    wave = math.sin(2.0 * math.pi * place / c.tile_length + c.tile_phase)
    extra += c.tiles * 0.5 * (1.0 + wave)
    extra += c.bend_drag * (abs(s.angle) / c.limit) ** c.bend_power
    beyond = s.x * math.cos(c.cliff_way) + s.y * math.sin(c.cliff_way) - c.cliff_at
    extra += c.cliff_drag * 0.5 * (1.0 + math.tanh(beyond / 0.02))
    return along - extra * way, across, twist


@njit(cache=True)
def side_slip(c, wheels, i, v_long, v_lat, still):
    """Advance the side slip of one tyre by one step and return it."""
    wheels[i, 3] = (wheels[i, 3] + c.step * v_lat / max(c.relaxation, 1e-9)) / (
        1.0 + c.step * abs(v_long) / max(c.relaxation, 1e-9)
    )
    side = v_lat / still
    if c.relaxation > 0.0:
        rubber = max(0.0, 1.0 - 0.5 * abs(v_long) / c.slow)
        side = wheels[i, 3] + 0.01 * rubber * v_lat / c.relaxation
        wheels[i, 3] = min(max(wheels[i, 3], -1.0), 1.0)
    return side * c.stiffness


@njit(cache=True)
def motor(c, before, felt, omega):
    """Return a motor's torque at rest, and what it loses per speed; `before` is its last torque."""
    stall = c.stall * c.motor_gain
    torque, loss = stall * felt, stall / c.no_load
    if c.motor == INDUCTANCE:
        share = c.step / (c.winding_lag + c.step)
        return before + share * (torque - before), share * loss
    if c.motor == CURRENT_LIMIT and abs(torque - loss * omega) > c.current_limit * stall:
        return math.copysign(c.current_limit * stall, torque - loss * omega), 0.0
    return torque, loss


@njit(cache=True)
def slowed(c, held, spin, inertia, damping, dry):
    """Return a wheel's speed, about `spin`, of its momentum and what damping and friction take."""
    if c.friction == SMOOTH:
        size = max(abs(spin), 1e-6)
        damping, dry = damping + dry * math.tanh(size * c.radius / CREEP) / size, 0.0
    left = max(abs(held) - c.step * dry, 0.0)
    return math.copysign(left, held) / (inertia + c.step * damping)


@njit(cache=True)
def turn_shaft(c, wheels, i, u, slow, load, rolling):
    """Return what turns one wheel beside the floor's force along it, and its inertia.

    That is a torque, what it loses per speed, dry friction [N*m]; then the motor's share of the
    torque and of what it loses.
    """
    omega, driven = wheels[i, 0], i > 1 or c.front_driven > 0.0
    dry, inertia, torque, damping = rolling * load * c.radius, c.spin_inertia, 0.0, c.damping
    current, loss = 0.0, 0.0
    if driven:
        u *= 1.0 + (c.asymmetry if i % 2 == 0 else -c.asymmetry)
        felt = wheels[i, 2] * u
        heat = 1.0 - 3.0 * c.fade * felt * felt - wheels[i, 2]
        wheels[i, 2] += heat * c.step / (WARM_S + c.step)
        around = c.ripple_turns * wheels[i, 1] + c.ripple_phase
        current, loss = motor(c, wheels[i, 5], felt, omega)
        torque = current + c.ripple * math.sin(around)
        damping += loss + c.churn * abs(omega)
        inertia += c.rotor
        turn = omega / STICTION_FADE
        dry += c.coulomb + c.stiction * math.exp(-turn * turn) + (c.hold if slow else 0.0)
        dry += c.stribeck * math.exp(-abs(turn))
    return torque, damping, dry, inertia, current, loss


@njit(cache=True)
def spin_wheel(c, wheels, i, u, slow, load, grip, v_long, v_lat, rolling):
    """Advance one wheel; return the floor's forces on it, along and across [N]."""
    omega = wheels[i, 0]
    still = max(abs(v_long), c.slow)
    side = side_slip(c, wheels, i, v_long, v_lat, still)
    torque, damping, dry, inertia, current, loss = turn_shaft(c, wheels, i, u, slow, load, rolling)
    new = omega
    for _ in range(2):
        slip = (c.radius * new - v_long) / still
        if c.combined_slip == SLIP_VECTOR:
            slip = math.hypot(slip, side * c.slip_peak / c.side_slip_peak)
        stiff = load * grip * over_slip(
            c, slip, c.slip_peak, c.force_peak, c.slip_slide, c.force_slide, c.tyre_shape,
            c.tyre_bend,
        )  # fmt: skip
        stiff /= still
        held = inertia * omega + c.step * (torque + stiff * v_long * c.radius)
        new = slowed(c, held, new, inertia, damping + stiff * c.radius * c.radius, dry)
    wheels[i, 0] = new
    wheels[i, 1] += c.step * new
    wheels[i, 5] = current - loss * new
    along = stiff * (c.radius * new - v_long)
    size = side
    if c.combined_slip == SLIP_VECTOR:
        size = math.hypot(side, (c.radius * new - v_long) / still * c.side_slip_peak / c.slip_peak)
    across = -load * grip * side * over_slip(
        c, size, c.side_slip_peak, c.side_force_peak, c.side_slip_slide, c.side_force_slide,
        c.side_tyre_shape, c.side_tyre_bend,
    )  # fmt: skip
    if c.combined_slip == FRICTION_ELLIPSE:
        used = along / max(load * grip * c.force_peak, 1e-9)
        across *= math.sqrt(max(1.0 - used * used, 0.0))
    return along, across


@njit(cache=True)
def press(c, s, wheels, i, ahead, aside):
    """Advance the squeeze of one tyre under its spring; return the load beyond that at rest [N]."""
    up = s.heave + aside * s.roll - ahead * s.pitch
    rise = s.heave_rate + aside * s.roll_rate - ahead * s.pitch_rate
    stiff, damped = c.spring + TYRE_STIFFNESS, c.damper + TYRE_DAMPING
    change = -(c.spring * up + c.damper * rise + stiff * wheels[i, 4]) / (damped + c.step * stiff)
    wheels[i, 4] += c.step * change
    return TYRE_STIFFNESS * wheels[i, 4] + TYRE_DAMPING * change


@njit(cache=True)
def sway(c, s, lift, roll, pitch):
    """Advance heave, roll and pitch by one step under a force [N] and moments [N*m]."""
    s.heave_rate += c.step * lift / (c.mass - 4.0 * c.hub)
    s.roll_rate += c.step * roll / c.roll_inertia
    s.pitch_rate += c.step * pitch / c.pitch_inertia
    s.heave += c.step * s.heave_rate
    s.roll += c.step * s.roll_rate
    s.pitch += c.step * s.pitch_rate


@njit(cache=True)
def transferred(c, s, front, left):
    """Return the load beyond that at rest of a wheel under a rigid body [N]."""
    along = s.load_push * c.height / (2.0 * c.base) * (-1.0 if front else 1.0)
    return c.mass * (along - left * s.load_side * c.height / (2.0 * c.track))


@njit(cache=True)
def travel(c, s, twist):
    """Advance the body over the floor by one step under `s.push`, `s.side` and a moment [N*m]."""
    vx = s.vx + c.step * (s.push + s.yaw_rate * s.vy)
    vy = s.vy + c.step * (s.side - s.yaw_rate * s.vx)
    turn = s.yaw_rate + c.step * twist / c.inertia
    mean_x, mean_y, mean = vx, vy, turn
    if c.body == MIDPOINT:
        mean_x, mean_y, mean = 0.5 * (s.vx + vx), 0.5 * (s.vy + vy), 0.5 * (s.yaw_rate + turn)
        vx = s.vx + c.step * (s.push + mean * mean_y)
        vy = s.vy + c.step * (s.side - mean * mean_x)
    s.vx, s.vy, s.yaw_rate = vx, vy, turn
    middle = s.yaw + 0.5 * c.step * mean
    drift = mean_y - mean * c.cog
    s.x += c.step * (mean_x * math.cos(middle) - drift * math.sin(middle))
    s.y += c.step * (mean_x * math.sin(middle) + drift * math.cos(middle))
    s.yaw += c.step * mean


@njit(cache=True)
def move(c, s, wheels, t, u):
    """Advance wheels and body by one step."""
    along, across, twist = outside_force(c, s, t)
    lift, roll, pitch = 0.0, 0.0, 0.0
    slow, tan, front_side = abs(s.throttle) < 0.005, math.tan(s.angle), 0.0
    cos_yaw, sin_yaw = math.cos(s.yaw), math.sin(s.yaw)
    grip = c.grip * (1.0 + c.warm_grip * s.warmth)
    for i in range(4):
        front, left = i < 2, 1.0 if i % 2 == 0 else -1.0
        ahead, aside = (c.base if front else 0.0), 0.5 * c.track * left
        share = (c.cog if front else c.base - c.cog) / c.base
        more = 0.0
        if c.suspension == SPRUNG:
            more = press(c, s, wheels, i, ahead - c.cog, aside)
        elif c.suspension == QUASI_STATIC:
            more = transferred(c, s, front, left)
        load = max(0.5 * c.mass * GRAVITY * share + more, 0.0)
        bend = math.atan2(c.base * tan, c.base - aside * tan) if front else 0.0
        cos, sin = math.cos(bend), math.sin(bend)
        v_x = s.vx - s.yaw_rate * aside - s.pitch_rate * c.height
        v_y = s.vy + s.yaw_rate * (ahead - c.cog) + s.roll_rate * c.height
        at_x = s.x + cos_yaw * ahead - sin_yaw * aside
        on = inside_patch(c, at_x, s.y + sin_yaw * ahead + cos_yaw * aside)
        f_long, f_lat = spin_wheel(
            c, wheels, i, u, slow, load, grip * (1.0 + (c.patch_grip - 1.0) * on),
            cos * v_x + sin * v_y, cos * v_y - sin * v_x, c.rolling + c.patch_rolling * on,
        )  # fmt: skip
        f_x, f_y = cos * f_long - sin * f_lat, sin * f_long + cos * f_lat
        along, across = along + f_x, across + f_y
        twist += (ahead - c.cog) * f_y - aside * f_x
        lift, roll = lift + more, roll + aside * more + c.height * f_y
        pitch -= (ahead - c.cog) * more + c.height * f_x
        front_side += f_lat if front else 0.0
    s.front_side, s.push, s.side = front_side, along / c.mass, across / c.mass
    if c.suspension == SPRUNG:
        sway(c, s, lift, roll, pitch)
    share = c.step / (LOAD_LAG + c.step)
    s.load_push += share * (s.push - s.load_push)
    s.load_side += share * (s.side - s.load_side)
    travel(c, s, twist)


@njit(cache=True)
def under_axle(c, s):
    """Return the floor's point under the middle of the rear axle, which a leaning body moves."""
    back, left = c.height * s.pitch, c.height * s.roll
    cos, sin = math.cos(s.yaw), math.sin(s.yaw)
    return s.x - cos * back - sin * left, s.y - sin * back + cos * left


@njit(cache=True)
def held(c, commands, t):
    """Return the command of the last row at or before `t`; zero before the first."""
    row = math.floor(t / c.command + 1e-6)
    return commands[min(row, len(commands) - 1)] if row >= 0 else 0.0


@njit(cache=True)
def advance(numbers, state, wheels, throttle, steering, shake, first, rows):
    """Advance by `rows` rows of 2.5 ms from row `first`; return them, shape (rows, 11).

    A row tells all of its end, accelerations too: those of the last step.
    """
    c, s = numbers[0], state[0]
    out, steps = np.empty((rows, 11)), round(ROW_S / c.step)
    for row in range(rows):
        for k in range(steps):
            t = ((first + row) * steps + k) * c.step
            steer(c, s, t, held(c, steering, t - c.steer_delay), held(c, shake, t))
            u = drive(c, s, t, held(c, throttle, t - c.drive_delay))
            move(c, s, wheels, t, u)
        out[row, 0] = (first + row + 1) * steps * c.step
        out[row, 1], out[row, 2] = under_axle(c, s)
        out[row, 3] = s.yaw
        out[row, 4], out[row, 5], out[row, 6] = s.vx, s.vy, s.yaw_rate
        out[row, 7], out[row, 8] = s.push, s.side
        out[row, 9], out[row, 10] = wheels[2, 1], wheels[3, 1]
    return out


def rows_per_command(numbers):
    """Return how many rows a command is in force."""
    return round(float(numbers["command"][0]) / ROW_S)


class Moving:
    """A car on the floor that is driven by commands, usually of 20 Hz; any family's.

    Args:
        numbers: Of the car, effects among them.
        pose: x [m], y [m], yaw [rad] of the rear axle's centre.
        shake: What a nervous servo adds, one number a command, in units of `numbers["shake"]`.
    """

    def __init__(self, numbers, pose, commands, shake=None):
        self.numbers = np.zeros(1, NUMBERS)
        self.become(numbers)
        self.state = np.zeros(1, STATE)
        self.state["x"], self.state["y"], self.state["yaw"] = pose
        self.wheels = np.zeros((4, len(WHEEL)))
        self.wheels[:, WHEEL.index("strength")] = 1.0
        self.throttle, self.steering = np.zeros(commands), np.zeros(commands)
        self.shake = np.zeros(commands) if shake is None else shake
        self.rows = np.empty((0, len(ROW)))

    def become(self, numbers):
        """Drive on with other numbers."""
        for name in NUMBERS.names:
            self.numbers[name] = numbers[name]

    def command(self, k, throttle, steering):
        """Give command `k`, drive until the next one is due, and return the new rows."""
        self.throttle[k], self.steering[k] = throttle, steering
        count = rows_per_command(self.numbers)
        return advance(
            self.numbers, self.state, self.wheels, self.throttle, self.steering, self.shake,
            k * count, count,
        )  # fmt: skip
