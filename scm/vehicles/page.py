"""The page that a car's kernel is written on: the skeleton's step, with room for the terms.

`assemble.py` fills the four gaps. What comes out is one plain Python file that reads from top to
bottom: parameters, body effects, wheel effects, one implicit step, results.
"""

PAGE = '''"""{title}

Generated from the car's list of terms; the file's name holds a hash of every source it calls.
One row of `block` is one whole car, one row of `parameters` its numbers.
"""

import math

import numpy as np

from scm.vehicles.body14 import (
    SCRATCH_SHAPE,
    add_contact,
    body_step,
    contact_velocity,
    corner_height,
    eliminate_hop,
    eliminate_spin,
    start_sums,
)
from scm.vehicles.jit import fleet_kernel
{imports}

GRAVITY = {gravity!r}


@fleet_kernel
def advance(block, parameters, alive, status, first, last, steps, dt):
    """Advance rows first..last-1 by `steps` substeps; a car that diverges is put back, marked."""
    scratch = np.empty(SCRATCH_SHAPE)
    before = np.empty(block.shape[1])
    for row in range(first, last):
        if not alive[row] or status[row] != 0:
            continue
        car = block[row]
        for i in range(block.shape[1]):
            before[i] = car[i]
{load}
        accel_x = car[{accel_x}]
        accel_y = car[{accel_y}]
        accel_z = car[{accel_z}]
        roll_accel = car[{roll_accel}]
        pitch_accel = car[{pitch_accel}]
        yaw_accel = car[{yaw_accel}]
        sprung_mass = mass - 4.0 * wheel_mass
        front_x = wheelbase - cog_to_rear_axle
        front_share = 0.5 * cog_to_rear_axle / wheelbase
        rear_share = 0.5 * front_x / wheelbase
        for _ in range(steps):
            cos_yaw = math.cos(yaw)
            sin_yaw = math.sin(yaw)
            vx = cos_yaw * vx_world + sin_yaw * vy_world
            vy = cos_yaw * vy_world - sin_yaw * vx_world

            # effects on the body
            force_x = 0.0
            force_y = 0.0
            moment_z = 0.0
            force_x_damping = 0.0
            force_y_damping = 0.0
            moment_z_damping = 0.0
{body_terms}

            # effects on each wheel: front-left, front-right, rear-left, rear-right
            start_sums(scratch)
            axle_front = 0.5 * (car[{wheel_speed}] + car[{wheel_speed} + 1])
            axle_rear = 0.5 * (car[{wheel_speed} + 2] + car[{wheel_speed} + 3])
            for w in range(4):
                front = 1.0 if w < 2 else 0.0
                side = 1.0 if w % 2 == 0 else -1.0
                driven = front_driven if w < 2 else rear_driven
                wheel_x = front_x if w < 2 else -cog_to_rear_axle
                wheel_y = 0.5 * side * track
                share = front_share if w < 2 else rear_share
                rest_spring_force = share * sprung_mass * GRAVITY
                rest_load = rest_spring_force + wheel_mass * GRAVITY
                hop = car[{hop} + w]
                hop_rate = car[{hop_rate} + w]
                omega = car[{wheel_speed} + w]
                axle_omega = axle_front if w < 2 else axle_rear
                corner_rate = corner_height(vz, roll_rate, pitch_rate, wheel_x, wheel_y)
                compression_rate = hop_rate - corner_rate
                compression = (
                    hop
                    - corner_height(z_cog - cog_height, roll, pitch, wheel_x, wheel_y)
                    + dt * compression_rate
                )
                x_wheel = x_cog + cos_yaw * wheel_x - sin_yaw * wheel_y
                y_wheel = y_cog + sin_yaw * wheel_x + cos_yaw * wheel_y
                floor_height = car[{floor_height} + w]
                floor_slope_x = car[{floor_slope_x} + w]
                floor_slope_y = car[{floor_slope_y} + w]
                floor_grip = car[{floor_grip} + w]
                floor_rolling = car[{floor_rolling} + w]
                floor_height += floor_slope_x * (x_wheel - car[{wheel_x} + w])
                floor_height += floor_slope_y * (y_wheel - car[{wheel_y} + w])
                car[{floor_height} + w] = floor_height
                car[{wheel_x} + w] = x_wheel
                car[{wheel_y} + w] = y_wheel
                slope_x = cos_yaw * floor_slope_x + sin_yaw * floor_slope_y
                slope_y = cos_yaw * floor_slope_y - sin_yaw * floor_slope_x
                over_x, over_y = contact_velocity(
                    vx, vy, roll_rate, pitch_rate, yaw_rate, wheel_x, wheel_y, cog_height
                )
                tyre_deflection_rate = slope_x * over_x + slope_y * over_y - hop_rate
                tyre_deflection = floor_height - hop + dt * tyre_deflection_rate
                suspension_force = 0.0
                tyre_x = 0.0
                tyre_y = 0.0
                wheel_torque = 0.0
                dry_torque = 0.0
                extra_inertia = 0.0
                suspension_force_damping = 0.0
                load_damping = 0.0
                tyre_x_damping = 0.0
                tyre_y_damping = 0.0
                wheel_torque_damping = 0.0
{wheel_terms}
                spin, follow, long, stiff_long = eliminate_spin(
                    dt, omega, spin_inertia + extra_inertia, wheel_radius, wheel_torque,
                    wheel_torque_damping, dry_torque, tyre_x, tyre_x_damping
                )
                scratch[w, 4] = spin
                scratch[w, 5] = follow
                eliminate_hop(
                    scratch, w, dt, wheel_x, wheel_y, wheel_mass,
                    suspension_force, suspension_force_damping, load, load_damping
                )
                add_contact(
                    scratch, w, wheel_x, wheel_y, cos_steer, sin_steer,
                    long, stiff_long, tyre_y, tyre_y_damping
                )
                force_x -= load * slope_x
                force_y -= load * slope_y
                moment_z -= load * (wheel_x * slope_y - wheel_y * slope_x)
                car[{wheel_load} + w] = load
                car[{wheel_steer} + w] = wheel_steer

            # one implicit step of the whole car
            dvx, dvy, dvz, droll_rate, dpitch_rate, dyaw_rate = body_step(
                scratch, dt, force_x, force_y, moment_z, force_x_damping, force_y_damping,
                moment_z_damping, mass, sprung_mass, roll_inertia, pitch_inertia, yaw_inertia,
                cog_height
            )
            for w in range(4):
                wheel_x = front_x if w < 2 else -cog_to_rear_axle
                wheel_y = 0.5 * track if w % 2 == 0 else -0.5 * track
                over_x, over_y = contact_velocity(
                    dvx, dvy, droll_rate, dpitch_rate, dyaw_rate, wheel_x, wheel_y, cog_height
                )
                spin = scratch[w, 4] + scratch[w, 5] * (
                    scratch[w, 2] * over_x + scratch[w, 3] * over_y
                )
                hop_rate = car[{hop_rate} + w] + scratch[w, 0] + scratch[w, 1] * corner_height(
                    dvz, droll_rate, dpitch_rate, wheel_x, wheel_y
                )
                car[{hop_rate} + w] = hop_rate
                car[{hop} + w] += dt * hop_rate
                car[{wheel_speed} + w] = spin
                car[{wheel_angle} + w] += dt * spin
            accel_x = dvx / dt
            accel_y = dvy / dt
            accel_z = dvz / dt
            roll_accel = droll_rate / dt
            pitch_accel = dpitch_rate / dt
            yaw_accel = dyaw_rate / dt
            vx_world += cos_yaw * dvx - sin_yaw * dvy
            vy_world += sin_yaw * dvx + cos_yaw * dvy
            vz += dvz
            roll_rate += droll_rate
            pitch_rate += dpitch_rate
            yaw_rate += dyaw_rate
            x_cog += dt * vx_world
            y_cog += dt * vy_world
            z_cog += dt * vz
            roll += dt * roll_rate
            pitch += dt * pitch_rate
            yaw += dt * yaw_rate
            time += dt

        if not (
            abs(vx_world) + abs(vy_world) + abs(vz) < 1e3
            and abs(roll_rate) + abs(pitch_rate) + abs(yaw_rate) < 1e4
            and abs(roll) + abs(pitch) < 1.5
            and abs(x_cog) + abs(y_cog) + abs(yaw) < 1e6
            and not math.isnan(throttle_command + steering_command)
        ):
            status[row] = 1
            for i in range(block.shape[1]):
                car[i] = before[i]
            for i in range({vx_world}, {yaw_rate} + 1):
                car[i] = 0.0
            for i in range({hop_rate}, {hop_rate} + 8):
                car[i] = 0.0
            for i in range({speed}, {yaw_accel} + 1):
                car[i] = 0.0
            continue
        yaw -= 2.0 * math.pi * math.ceil((yaw - math.pi) / (2.0 * math.pi))
        cos_yaw = math.cos(yaw)
        sin_yaw = math.sin(yaw)
{store}
        back = cog_to_rear_axle + cog_height * pitch
        left = cog_height * roll
        over_x, over_y = contact_velocity(
            cos_yaw * vx_world + sin_yaw * vy_world, cos_yaw * vy_world - sin_yaw * vx_world,
            roll_rate, pitch_rate, yaw_rate, -cog_to_rear_axle, 0.0, cog_height
        )
        for w in range(4):
            wheel_x = front_x if w < 2 else -cog_to_rear_axle
            wheel_y = 0.5 * track if w % 2 == 0 else -0.5 * track
            x_wheel = x_cog + cos_yaw * wheel_x - sin_yaw * wheel_y
            y_wheel = y_cog + sin_yaw * wheel_x + cos_yaw * wheel_y
            if steps > 0:
                car[{floor_height} + w] += car[{floor_slope_x} + w] * (
                    x_wheel - car[{wheel_x} + w]
                ) + car[{floor_slope_y} + w] * (y_wheel - car[{wheel_y} + w])
            car[{wheel_x} + w] = x_wheel
            car[{wheel_y} + w] = y_wheel
        car[{x}] = x_cog - cos_yaw * back - sin_yaw * left
        car[{y}] = y_cog - sin_yaw * back + cos_yaw * left
        car[{z}] = z_cog - cog_height + pitch * cog_to_rear_axle
        car[{speed}] = over_x
        car[{lateral_speed}] = over_y
        car[{accel_x}] = accel_x
        car[{accel_y}] = accel_y
        car[{accel_z}] = accel_z
        car[{roll_accel}] = roll_accel
        car[{pitch_accel}] = pitch_accel
        car[{yaw_accel}] = yaw_accel
'''
