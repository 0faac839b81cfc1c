"""The 14-degree-of-freedom car without any effect: masses, kinematics, one implicit step.

Sprung mass: x y z roll pitch yaw (angles small but for yaw). Each wheel: hop and spin. Velocities
of the sprung mass are kept in the world frame, so a coasting turn neither gains nor loses energy.

    (M + dt * sum J^T K J) * dv = dt * (sum J^T F + F_body - weight)     [kg*m/s, kg*m^2*rad/s]

F are the forces at the four contact points, four spring seats and on the body, J their lever arms,
K how fast each falls with its own velocity. Every wheel's hop and spin is eliminated by hand first.
Being implicit in K is what lets a 24 mg*m^2 front wheel, a stiff tyre and a car at rest stay calm
at 1 ms: with K the secant of the tyre curve, a step never overshoots the velocity where F vanishes.
"""

import math

from scm.arrays import Floats
from scm.vehicles.jit import law
from scm.vehicles.param import Normal, Param

GRAVITY = 9.80665
STATUS_OK, STATUS_DIVERGED = 0, 1

PARAMS = (
    Param("mass", 2.4, "kg", "body.mass_kg", (0.2, 60.0), "whole car, wheels included",
          Normal(2.4, 0.5), required=True),
    Param("yaw_inertia", 0.0229, "kg*m^2", "body.yaw_inertia_kgm2", (1e-4, 20.0),
          "whole car about z", required=True),
    Param("roll_inertia", 0.009, "kg*m^2", "body.roll_inertia_kgm2", (1e-4, 20.0),
          "sprung mass about x", required=True),
    Param("pitch_inertia", 0.017, "kg*m^2", "body.pitch_inertia_kgm2", (1e-4, 20.0),
          "sprung mass about y", required=True),
    Param("wheelbase", 0.14154, "m", "body.wheelbase_m", (0.05, 1.0),
          "front axle to rear axle", required=True),
    Param("track", 0.153, "m", "body.track_m", (0.03, 1.0),
          "left wheel's middle to right wheel's", required=True),
    Param("cog_to_rear_axle", 0.07077, "m", "body.cog_to_rear_axle_m", (0.005, 0.95),
          "centre of gravity ahead of the rear axle", required=True),
    Param("cog_height", 0.05, "m", "body.cog_height_m", (0.005, 0.5),
          "centre of gravity above the floor at rest", required=True),
    Param("wheel_radius", 0.0325, "m", "wheel.radius_m", (0.01, 0.2),
          "rolling radius", required=True),
    Param("wheel_mass", 0.045, "kg", "wheel.mass_kg", (0.005, 2.0),
          "unsprung mass of one corner", required=True),
    Param("spin_inertia", 2.377e-5, "kg*m^2", "wheel.spin_inertia_kgm2", (1e-6, 0.02),
          "one wheel about its axis", required=True),
    Param("front_driven", 0.0, "1", "drive.front_driven", (0.0, 1.0),
          "1 where the front wheels are driven", fit=False),
    Param("rear_driven", 1.0, "1", "drive.rear_driven", (0.0, 1.0),
          "1 where the rear wheels are driven", fit=False),
)  # fmt: skip

# A row of the fleet's block, (name, width): the skeleton's states, inputs and outputs in order.
STATES = (
    ("x_cog", 1), ("y_cog", 1), ("z_cog", 1), ("roll", 1), ("pitch", 1), ("yaw", 1),
    ("vx_world", 1), ("vy_world", 1), ("vz", 1),
    ("roll_rate", 1), ("pitch_rate", 1), ("yaw_rate", 1),
    ("time", 1), ("hop", 4), ("hop_rate", 4), ("wheel_speed", 4), ("wheel_angle", 4),
)  # fmt: skip
INPUTS = (
    ("throttle_command", 1), ("steering_command", 1), ("throttle_past", 1), ("steering_past", 1),
    ("battery", 1), ("air_x", 1), ("air_y", 1), ("floor_height", 4), ("floor_slope_x", 4),
    ("floor_slope_y", 4), ("floor_grip", 4), ("floor_rolling", 4),
)  # fmt: skip
OUTPUTS = (
    ("x", 1), ("y", 1), ("z", 1), ("speed", 1), ("lateral_speed", 1),
    ("accel_x", 1), ("accel_y", 1), ("accel_z", 1),
    ("roll_accel", 1), ("pitch_accel", 1), ("yaw_accel", 1),
    ("steer_angle", 1),
    ("wheel_steer", 4), ("wheel_load", 4), ("wheel_x", 4), ("wheel_y", 4),
)  # fmt: skip
SCRATCH_SHAPE = (6, 10)  # rows 0-3: one wheel each; 4: sums over hops; 5: over contact points


@law
def contact_velocity(
    vx: float, vy: float, roll_rate: float, pitch_rate: float, yaw_rate: float,
    wheel_x: float, wheel_y: float, cog_height: float,
) -> tuple[float, float]:  # fmt: skip
    """Velocity of a contact point over the floor, body frame [m/s]."""
    return (
        vx - wheel_y * yaw_rate - cog_height * pitch_rate,
        vy + wheel_x * yaw_rate + cog_height * roll_rate,
    )


@law
def corner_height(z: float, roll: float, pitch: float, wheel_x: float, wheel_y: float) -> float:
    """How far (or, of rates, how fast) the body's corner is up from rest [m, m/s]."""
    return z + wheel_y * roll - wheel_x * pitch


@law
def start_sums(scratch: Floats) -> None:
    """Forget the forces of the last substep."""
    for i in range(9):
        scratch[4, i] = 0.0
        scratch[5, i] = 0.0


@law
def eliminate_hop(
    scratch: Floats, w: int, dt: float, wheel_x: float, wheel_y: float, wheel_mass: float,
    suspension_force: float, suspension_damping: float, load: float, load_damping: float,
) -> None:  # fmt: skip
    """Solve one wheel's hop for its share in the body's heave, roll and pitch."""
    inertia = wheel_mass + dt * (suspension_damping + load_damping)
    free = dt * (load - suspension_force - wheel_mass * GRAVITY) / inertia
    follow = dt * suspension_damping / inertia
    force = suspension_force + suspension_damping * free
    stiff = suspension_damping * (1.0 - follow)
    scratch[w, 0] = free
    scratch[w, 1] = follow
    scratch[4, 0] += force
    scratch[4, 1] += wheel_y * force
    scratch[4, 2] -= wheel_x * force
    scratch[4, 3] += stiff
    scratch[4, 4] += stiff * wheel_y
    scratch[4, 5] -= stiff * wheel_x
    scratch[4, 6] += stiff * wheel_y * wheel_y
    scratch[4, 7] -= stiff * wheel_y * wheel_x
    scratch[4, 8] += stiff * wheel_x * wheel_x


@law
def eliminate_spin(
    dt: float, omega: float, inertia: float, radius: float, torque: float, torque_damping: float,
    dry_torque: float, tyre_x: float, tyre_x_damping: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Solve one wheel's spin: (spin, spin per contact speed, force, force lost per contact speed).

    Dry friction holds the wheel where it can, and else brakes it: it never turns a wheel back.
    """
    whole = inertia + dt * (torque_damping + radius * radius * tyre_x_damping)
    free = omega + dt * (torque - radius * tyre_x) / whole
    held = dt * dry_torque / whole
    if abs(free) <= held and held > 0.0:
        return 0.0, 0.0, tyre_x - tyre_x_damping * radius * omega, tyre_x_damping
    spin = free - math.copysign(held, free)
    follow = dt * radius * tyre_x_damping / whole
    force = tyre_x + tyre_x_damping * radius * (spin - omega)
    return spin, follow, force, tyre_x_damping * (1.0 - radius * follow)


@law
def add_contact(
    scratch: Floats, w: int, wheel_x: float, wheel_y: float, cos_steer: float, sin_steer: float,
    force_long: float, stiff_long: float, force_lat: float, stiff_lat: float,
) -> None:  # fmt: skip
    """Add one contact point's force, and how it falls with velocity, to the body's sums."""
    fx = cos_steer * force_long - sin_steer * force_lat
    fy = sin_steer * force_long + cos_steer * force_lat
    kxx = cos_steer * cos_steer * stiff_long + sin_steer * sin_steer * stiff_lat
    kxy = cos_steer * sin_steer * (stiff_long - stiff_lat)
    kyy = sin_steer * sin_steer * stiff_long + cos_steer * cos_steer * stiff_lat
    turn_x = wheel_x * kxy - wheel_y * kxx
    turn_y = wheel_x * kyy - wheel_y * kxy
    scratch[w, 2] = cos_steer
    scratch[w, 3] = sin_steer
    scratch[5, 0] += fx
    scratch[5, 1] += fy
    scratch[5, 2] += wheel_x * fy - wheel_y * fx
    scratch[5, 3] += kxx
    scratch[5, 4] += kxy
    scratch[5, 5] += kyy
    scratch[5, 6] += turn_x
    scratch[5, 7] += turn_y
    scratch[5, 8] += wheel_x * turn_y - wheel_y * turn_x


Six = tuple[float, float, float, float, float, float]


@law
def body_step(
    scratch: Floats, dt: float, force_x: float, force_y: float, moment_z: float,
    force_x_damping: float, force_y_damping: float, moment_z_damping: float, mass: float,
    sprung_mass: float, roll_inertia: float, pitch_inertia: float, yaw_inertia: float,
    cog_height: float,
) -> Six:  # fmt: skip
    """Change of the body's six velocities: vx, vy, vz, roll rate, pitch rate, yaw rate.

    Heave couples only with roll and pitch, so it is eliminated first; five equations are left.
    """
    hop, touch, h = scratch[4], scratch[5], cog_height
    heave = 1.0 / (sprung_mass + dt * hop[3])
    heave_roll, heave_pitch = dt * hop[4], dt * hop[5]
    lift = dt * (hop[0] - sprung_mass * GRAVITY)
    hx, hy = dt * h * touch[3], dt * h * touch[5]
    cross = dt * h * touch[4]
    roll = roll_inertia + h * hy + dt * hop[6] - heave * heave_roll * heave_roll
    pitch = pitch_inertia + h * hx + dt * hop[8] - heave * heave_pitch * heave_pitch
    both = dt * hop[7] - h * cross - heave * heave_roll * heave_pitch
    dvx, dvy, droll, dpitch, dyaw = solve_five(
        mass + dt * (touch[3] + force_x_damping),
        dt * touch[4], mass + dt * (touch[5] + force_y_damping),
        cross, hy, roll,
        -hx, -cross, both, pitch,
        dt * touch[6], dt * touch[7], dt * h * touch[7], -dt * h * touch[6],
        yaw_inertia + dt * (touch[8] + moment_z_damping),
        dt * (touch[0] + force_x),
        dt * (touch[1] + force_y),
        dt * (hop[1] + h * touch[1]) - heave * heave_roll * lift,
        dt * (hop[2] - h * touch[0]) - heave * heave_pitch * lift,
        dt * (touch[2] + moment_z),
    )  # fmt: skip
    dvz = heave * (lift - heave_roll * droll - heave_pitch * dpitch)
    return dvx, dvy, dvz, droll, dpitch, dyaw


@law
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
