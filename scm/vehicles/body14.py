"""The 14-degree-of-freedom car without any effect: masses, kinematics, one implicit step.

Sprung mass: x y z roll pitch yaw (angles small but for yaw). Each wheel: hop and spin. Velocities
of the sprung mass are kept in the world frame, so a coasting turn neither gains nor loses energy.
x, y and yaw are the whole car's, about its centre of gravity; z, roll and pitch are the sprung
mass's about its own, which lies where the whole car's is once four wheels are added at the axles.

    (M + dt * sum J^T K J) * dv = dt * (sum J^T F + F_body - weight)     [kg*m/s, kg*m^2*rad/s]

F are the forces at the four contact points, four spring seats and on the body, J their lever arms,
K how fast each falls with its own velocity. Every wheel's hop and spin is eliminated by hand first.
Being implicit in K is what lets a 24 mg*m^2 front wheel, a stiff tyre and a car at rest stay calm
at 1 ms: with K the secant of the tyre curve, a step never overshoots the velocity where F vanishes.
"""

import math

from scm.vehicles.jit import kernel_function
from scm.vehicles.param import Normal, Param
from scm.vehicles.physics_variables import Per

GRAVITY = 9.80665
STATUS_OK, STATUS_DIVERGED, STATUS_ROLLED = 0, 1, 2

PARAMS = (
    Param("mass", 2.4, "kg", "body.mass_kg", (0.2, 5000.0), "whole car, wheels included",
          Normal(2.4, 0.5), required=True),
    Param("yaw_inertia", 0.0229, "kg*m^2", "body.yaw_inertia_kgm2", (1e-4, 2e4),
          "whole car about z", required=True),
    Param("roll_inertia", 0.009, "kg*m^2", "body.roll_inertia_kgm2", (1e-4, 2e4),
          "sprung mass about x", required=True),
    Param("pitch_inertia", 0.017, "kg*m^2", "body.pitch_inertia_kgm2", (1e-4, 2e4),
          "sprung mass about y", required=True),
    Param("wheelbase", 0.14154, "m", "body.wheelbase_m", (0.05, 5.0),
          "front axle to rear axle", required=True),
    Param("track", 0.153, "m", "body.track_m", (0.03, 3.0),
          "left wheel's middle to right wheel's", required=True),
    Param("cog_to_rear_axle", 0.07077, "m", "body.cog_to_rear_axle_m", (0.005, 4.75),
          "centre of gravity ahead of the rear axle", required=True),
    Param("cog_height", 0.05, "m", "body.cog_height_m", (0.005, 1.5),
          "centre of gravity above the floor at rest", required=True),
    Param("wheel_radius", 0.0325, "m", "wheel.radius_m", (0.01, 0.6),
          "rolling radius", required=True),
    Param("wheel_mass", 0.045, "kg", "wheel.mass_kg", (0.005, 100.0),
          "unsprung mass of one corner", required=True),
    Param("spin_inertia", 2.377e-5, "kg*m^2", "wheel.spin_inertia_kgm2", (1e-6, 10.0),
          "one wheel about its axis", required=True),
    Param("front_driven", 0.0, "1", "drive.front_driven", (0.0, 1.0),
          "1 where the front wheels are driven", fit=False),
    Param("rear_driven", 1.0, "1", "drive.rear_driven", (0.0, 1.0),
          "1 where the rear wheels are driven", fit=False),
)  # fmt: skip

# What a fleet's block holds of each car and of each wheel, beside what terms keep. Velocities and
# what follows from them stand together: a car that is frozen loses them.
INPUTS = {
    Per.BODY: (
        "throttle_command", "steering_command", "throttle_past", "steering_past", "battery",
        "air_x", "air_y",
    ),
    Per.WHEEL: ("floor_slope_x", "floor_slope_y", "floor_grip", "floor_rolling"),
}  # fmt: skip
STATES = {
    Per.BODY: (
        "x_cog", "y_cog", "z_cog", "roll", "pitch", "yaw", "time", "steer_angle",
        "vx_world", "vy_world", "vz", "roll_rate", "pitch_rate", "yaw_rate",
        "accel_x", "accel_y", "accel_z", "roll_accel", "pitch_accel", "yaw_accel",
    ),
    Per.WHEEL: (
        "floor_height", "hop", "wheel_angle", "wheel_load", "wheel_slope", "hop_rate",
        "wheel_speed",
    ),
}  # fmt: skip
OUTPUTS = {
    Per.BODY: ("speed", "lateral_speed", "x", "y", "z"),
    Per.WHEEL: ("wheel_steer", "ground_x", "ground_y"),
}
MOTION = (
    "vx_world", "vy_world", "vz", "roll_rate", "pitch_rate", "yaw_rate", "accel_x", "accel_y",
    "accel_z", "roll_accel", "pitch_accel", "yaw_accel", "hop_rate", "wheel_speed", "speed",
    "lateral_speed",
)  # fmt: skip


@kernel_function
def sprung_part(
    mass: float, cog_to_rear_axle: float, wheel_mass: float, wheelbase: float
) -> tuple[float, float]:
    """Mass [kg] and place ahead of the rear axle [m] of what the springs carry."""
    sprung_mass = mass - 4.0 * wheel_mass
    return sprung_mass, (mass * cog_to_rear_axle - 2.0 * wheel_mass * wheelbase) / sprung_mass


@kernel_function
def contact_velocity(
    vx: float, vy: float, roll_rate: float, pitch_rate: float, yaw_rate: float,
    wheel_x: float, wheel_y: float, cog_height: float,
) -> tuple[float, float]:  # fmt: skip
    """Velocity of a contact point over the floor, body frame [m/s]."""
    return (
        vx - wheel_y * yaw_rate - cog_height * pitch_rate,
        vy + wheel_x * yaw_rate + cog_height * roll_rate,
    )


@kernel_function
def corner_height(z: float, roll: float, pitch: float, spring_x: float, wheel_y: float) -> float:
    """How far (or, of rates, how fast) the body's corner is up from rest [m, m/s]."""
    return z + wheel_y * roll - spring_x * pitch


@kernel_function
def eliminate_hop(
    dt: float, wheel_mass: float, suspension_force: float, suspension_damping: float, load: float,
    load_damping: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Solve one wheel's hop: (its free change, its share in the corner's, force, force lost)."""
    per_inertia = 1.0 / (wheel_mass + dt * (suspension_damping + load_damping))
    free = dt * (load - suspension_force - wheel_mass * GRAVITY) * per_inertia
    follow = dt * suspension_damping * per_inertia
    force = suspension_force + suspension_damping * free
    return free, follow, force, suspension_damping * (1.0 - follow)


@kernel_function
def eliminate_spin(
    dt: float, omega: float, inertia: float, radius: float, torque: float, torque_damping: float,
    dry_torque: float, tyre_x: float, tyre_x_damping: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Solve one wheel's spin: (spin, spin per contact speed, force, force lost per contact speed).

    Dry friction holds the wheel where it can, and else brakes it: it never turns a wheel back.
    """
    grip = radius * tyre_x_damping
    per_whole = 1.0 / (inertia + dt * (torque_damping + radius * grip))
    free = omega + dt * (torque - radius * tyre_x) * per_whole
    held = dt * dry_torque * per_whole
    beyond = abs(free) - held
    spin = math.copysign(max(beyond, 0.0), free)
    follow = 0.0 if beyond < 0.0 else dt * grip * per_whole
    return spin, follow, tyre_x + grip * (spin - omega), tyre_x_damping * (1.0 - radius * follow)


@kernel_function
def turn_contact(
    cos_steer: float, sin_steer: float, force_long: float, stiff_long: float, force_lat: float,
    stiff_lat: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Turn one contact's force, and how it falls with velocity, from the wheel to the body."""
    fx = cos_steer * force_long - sin_steer * force_lat
    fy = sin_steer * force_long + cos_steer * force_lat
    more = stiff_long - stiff_lat
    turned = sin_steer * more
    kxx = stiff_long - sin_steer * turned
    return fx, fy, kxx, cos_steer * turned, stiff_lat + sin_steer * turned


Six = tuple[float, float, float, float, float, float]


@kernel_function
def body_step(
    dt: float, mass: float, sprung_mass: float, roll_inertia: float, pitch_inertia: float,
    yaw_inertia: float, cog_height: float, force_x: float, force_y: float, moment_z: float,
    force_x_damping: float, force_y_damping: float, moment_z_damping: float,
    spring: float, spring_roll: float, spring_pitch: float, stiff: float, stiff_y: float,
    stiff_x: float, stiff_yy: float, stiff_xy: float, stiff_xx: float,
    contact_x: float, contact_y: float, contact_turn: float, kxx: float, kxy: float, kyy: float,
    turn_x: float, turn_y: float, turn_turn: float,
) -> Six:  # fmt: skip
    """Change of the body's six velocities: vx, vy, vz, roll rate, pitch rate, yaw rate.

    Heave couples only with roll and pitch, so it is eliminated first; five equations are left.
    """
    h = cog_height
    heave = 1.0 / (sprung_mass + dt * stiff)
    heave_roll, heave_pitch = dt * stiff_y, -(dt * stiff_x)
    lift = dt * (spring - sprung_mass * GRAVITY)
    roll_heave, pitch_heave = heave * heave_roll, heave * heave_pitch
    hx, hy, cross = dt * h * kxx, dt * h * kyy, dt * h * kxy
    roll = roll_inertia + h * hy + dt * stiff_yy - roll_heave * heave_roll
    pitch = pitch_inertia + h * hx + dt * stiff_xx - pitch_heave * heave_pitch
    both = -(dt * stiff_xy + h * cross + roll_heave * heave_pitch)
    dvx, dvy, droll, dpitch, dyaw = solve_five(
        mass + dt * (kxx + force_x_damping),
        dt * kxy, mass + dt * (kyy + force_y_damping),
        cross, hy, roll,
        -hx, -cross, both, pitch,
        dt * turn_x, dt * turn_y, dt * h * turn_y, -(dt * h * turn_x),
        yaw_inertia + dt * (turn_turn + moment_z_damping),
        dt * (contact_x + force_x),
        dt * (contact_y + force_y),
        dt * (spring_roll + h * contact_y) - roll_heave * lift,
        dt * (spring_pitch - h * contact_x) - pitch_heave * lift,
        dt * (contact_turn + moment_z),
    )  # fmt: skip
    dvz = heave * (lift - heave_roll * droll - heave_pitch * dpitch)
    return dvx, dvy, dvz, droll, dpitch, dyaw


@kernel_function
def solve_five(
    a00: float,
    a10: float, a11: float,
    a20: float, a21: float, a22: float,
    a30: float, a31: float, a32: float, a33: float,
    a40: float, a41: float, a42: float, a43: float, a44: float,
    b0: float, b1: float, b2: float, b3: float, b4: float,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Solve five symmetric positive equations given by their lower triangle and right-hand side.

    Gauss without a loop: written out, the compiler keeps all of it in registers.
    """
    i0 = 1.0 / a00
    l1, l2, l3, l4 = a10 * i0, a20 * i0, a30 * i0, a40 * i0
    a11, a21, a31, a41 = a11 - l1 * a10, a21 - l2 * a10, a31 - l3 * a10, a41 - l4 * a10
    a22, a32, a42 = a22 - l2 * a20, a32 - l3 * a20, a42 - l4 * a20
    a33, a43, a44 = a33 - l3 * a30, a43 - l4 * a30, a44 - l4 * a40
    b1, b2, b3, b4 = b1 - l1 * b0, b2 - l2 * b0, b3 - l3 * b0, b4 - l4 * b0
    i1 = 1.0 / a11
    l2, l3, l4 = a21 * i1, a31 * i1, a41 * i1
    a22, a32, a42 = a22 - l2 * a21, a32 - l3 * a21, a42 - l4 * a21
    a33, a43, a44 = a33 - l3 * a31, a43 - l4 * a31, a44 - l4 * a41
    b2, b3, b4 = b2 - l2 * b1, b3 - l3 * b1, b4 - l4 * b1
    i2 = 1.0 / a22
    l3, l4 = a32 * i2, a42 * i2
    a33, a43, a44 = a33 - l3 * a32, a43 - l4 * a32, a44 - l4 * a42
    b3, b4 = b3 - l3 * b2, b4 - l4 * b2
    i3 = 1.0 / a33
    l4 = a43 * i3
    a44 -= l4 * a43
    b4 -= l4 * b3
    x4 = b4 / a44
    x3 = (b3 - a43 * x4) * i3
    x2 = (b2 - a32 * x3 - a42 * x4) * i2
    x1 = (b1 - a21 * x2 - a31 * x3 - a41 * x4) * i1
    x0 = (b0 - a10 * x1 - a20 * x2 - a30 * x3 - a40 * x4) * i0
    return x0, x1, x2, x3, x4
