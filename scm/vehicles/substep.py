"""The skeleton's substep as text, with room for the terms: what happens, stage by stage.

In `compiler/`, `assemble.py` fills the gaps, `program.py` moves what is constant out, and `print_*`
write it as loops over lanes or over cars. BODY and SOLVE happen once a car, WHEEL and ROLL once a
wheel; a name like `wheel_speed__0` means the front-left wheel's from outside a wheel's stage.
"""

import re

# before the substeps: commands beyond full count as full, and what the car's numbers come to
START = """
throttle_command = 1.0 if throttle_command > 1.0 else throttle_command
throttle_command = -1.0 if throttle_command < -1.0 else throttle_command
steering_command = 1.0 if steering_command > 1.0 else steering_command
steering_command = -1.0 if steering_command < -1.0 else steering_command
mass = mass + added_mass
cog_to_rear_axle = cog_to_rear_axle + added_cog_x
cog_height = cog_height + added_cog_z
"""

# forces act in the frame of the substep's end: in a steady turn one of its start sees the turning
# of a whole substep as side slip
BODY = """
sprung_mass, sprung_to_rear_axle = sprung_part(mass, cog_to_rear_axle, wheel_mass, wheelbase)
sin_yaw, cos_yaw = sin_cos(yaw + dt * yaw_rate)
steer_before = steer_angle
vx = cos_yaw * vx_world + sin_yaw * vy_world
vy = cos_yaw * vy_world - sin_yaw * vx_world
axle_front = 0.5 * (wheel_speed__0 + wheel_speed__1)
axle_rear = 0.5 * (wheel_speed__2 + wheel_speed__3)
drive_omega = (2.0 * front_driven * axle_front + 2.0 * rear_driven * axle_rear) * (
    1.0 / max(2.0 * (front_driven + rear_driven), 1.0)
)
"""

WHEEL = """
driven = front_driven if front > 0.5 else rear_driven
wheel_x = wheelbase - cog_to_rear_axle if front > 0.5 else -cog_to_rear_axle
wheel_y = 0.5 * side * track
seat_front_x = wheelbase - sprung_to_rear_axle
seat_x = seat_front_x if front > 0.5 else -sprung_to_rear_axle
share = 0.5 * (sprung_to_rear_axle if front > 0.5 else seat_front_x) / wheelbase
rest_spring_force = share * sprung_mass * GRAVITY
rest_load = rest_spring_force + wheel_mass * GRAVITY
x_wheel = x_cog + cos_yaw * wheel_x - sin_yaw * wheel_y
y_wheel = y_cog + sin_yaw * wheel_x + cos_yaw * wheel_y
omega = wheel_speed
slope_before = wheel_slope
axle_omega = axle_front if front > 0.5 else axle_rear
over_x, over_y = contact_velocity(
    vx, vy, roll_rate, pitch_rate, yaw_rate, wheel_x, wheel_y, cog_height
)
compression_rate = hop_rate - corner_height(vz, roll_rate, pitch_rate, seat_x, wheel_y)
compression = (
    hop - corner_height(z_cog - cog_height, roll, pitch, seat_x, wheel_y) + dt * compression_rate
)
slope_x = cos_yaw * floor_slope_x + sin_yaw * floor_slope_y
slope_y = cos_yaw * floor_slope_y - sin_yaw * floor_slope_x
floor_rate = slope_x * over_x + slope_y * over_y
tyre_deflection_rate = floor_rate - hop_rate
tyre_deflection = floor_height - hop + dt * tyre_deflection_rate
"""

# after wheel_slope is known
FRAME = """
cos_steer = 1.0 / math.sqrt(1.0 + wheel_slope * wheel_slope)
sin_steer = wheel_slope * cos_steer
v_long = cos_steer * over_x + sin_steer * over_y
v_lat = cos_steer * over_y - sin_steer * over_x
"""

# after road_angle is known; 1.2 rad is where every linkage has ended
ROAD = """
road_slope = tan_small(min(max(road_angle, -1.2), 1.2))
"""

ELIMINATE = """
hop_free, hop_follow, seat_force, seat_stiff = eliminate_hop(
    dt, wheel_mass, suspension_force, suspension_force_damping, load, load_damping
)
spin, spin_follow, force_long, stiff_long = eliminate_spin(
    dt, omega, spin_inertia + extra_inertia, wheel_radius, wheel_torque, wheel_torque_damping,
    dry_torque, tyre_x, tyre_x_damping
)
turned_x, turned_y, stiff_xx, stiff_xy, stiff_yy = turn_contact(
    cos_steer, sin_steer, force_long, stiff_long, tyre_y, tyre_y_damping
)
contact_x = turned_x - load * slope_x
contact_y = turned_y - load * slope_y
floor_height = floor_height + dt * floor_rate
wheel_load = load
"""

SOLVE = """
x_front = wheelbase - cog_to_rear_axle
x_rear = -cog_to_rear_axle
seat_x_front = wheelbase - sprung_to_rear_axle
seat_x_rear = -sprung_to_rear_axle
y_left = 0.5 * track
seat_front = seat_force__0 + seat_force__1
seat_rear = seat_force__2 + seat_force__3
seat_left = (seat_force__0 - seat_force__1) + (seat_force__2 - seat_force__3)
hold_front = seat_stiff__0 + seat_stiff__1
hold_rear = seat_stiff__2 + seat_stiff__3
hold_front_left = seat_stiff__0 - seat_stiff__1
hold_rear_left = seat_stiff__2 - seat_stiff__3
pull_left = (contact_x__0 - contact_x__1) + (contact_x__2 - contact_x__3)
pull = (contact_x__0 + contact_x__1) + (contact_x__2 + contact_x__3)
side_front = contact_y__0 + contact_y__1
side_rear = contact_y__2 + contact_y__3
long_left = (stiff_xx__0 - stiff_xx__1) + (stiff_xx__2 - stiff_xx__3)
all_stiff_xx = (stiff_xx__0 + stiff_xx__1) + (stiff_xx__2 + stiff_xx__3)
cross_front = stiff_xy__0 + stiff_xy__1
cross_rear = stiff_xy__2 + stiff_xy__3
cross_front_left = stiff_xy__0 - stiff_xy__1
cross_rear_left = stiff_xy__2 - stiff_xy__3
lat_front = stiff_yy__0 + stiff_yy__1
lat_rear = stiff_yy__2 + stiff_yy__3
turn_cross = x_front * cross_front_left + x_rear * cross_rear_left
all_seat_stiff = hold_front + hold_rear
dvx, dvy, dvz, droll_rate, dpitch_rate, dyaw_rate = body_step(
    dt, mass, sprung_mass, roll_inertia, pitch_inertia, yaw_inertia, cog_height,
    force_x, force_y, moment_z, force_x_damping, force_y_damping, moment_z_damping,
    seat_front + seat_rear,
    y_left * seat_left,
    -(seat_x_front * seat_front + seat_x_rear * seat_rear),
    all_seat_stiff,
    y_left * (hold_front_left + hold_rear_left),
    seat_x_front * hold_front + seat_x_rear * hold_rear,
    y_left * y_left * all_seat_stiff,
    y_left * (seat_x_front * hold_front_left + seat_x_rear * hold_rear_left),
    seat_x_front * seat_x_front * hold_front + seat_x_rear * seat_x_rear * hold_rear,
    pull,
    side_front + side_rear,
    x_front * side_front + x_rear * side_rear - y_left * pull_left,
    all_stiff_xx,
    cross_front + cross_rear,
    lat_front + lat_rear,
    x_front * cross_front + x_rear * cross_rear - y_left * long_left,
    x_front * lat_front + x_rear * lat_rear - y_left * (cross_front_left + cross_rear_left),
    x_front * x_front * lat_front + x_rear * x_rear * lat_rear
    + y_left * (y_left * all_stiff_xx - 2.0 * turn_cross),
)
accel_x = dvx * (1.0 / dt)
accel_y = dvy * (1.0 / dt)
accel_z = (dvz + (sprung_to_rear_axle - cog_to_rear_axle) * dpitch_rate) * (1.0 / dt)
roll_accel = droll_rate * (1.0 / dt)
pitch_accel = dpitch_rate * (1.0 / dt)
yaw_accel = dyaw_rate * (1.0 / dt)
vx_world = vx_world + (cos_yaw * dvx - sin_yaw * dvy)
vy_world = vy_world + (sin_yaw * dvx + cos_yaw * dvy)
vz = vz + dvz
roll_rate = roll_rate + droll_rate
pitch_rate = pitch_rate + dpitch_rate
yaw_rate = yaw_rate + dyaw_rate
x_cog = x_cog + dt * vx_world
y_cog = y_cog + dt * vy_world
z_cog = z_cog + dt * vz
roll = roll + dt * roll_rate
pitch = pitch + dt * pitch_rate
yaw = yaw + dt * yaw_rate
time = time + dt
"""

ROLL = """
change_x, change_y = contact_velocity(
    dvx, dvy, droll_rate, dpitch_rate, dyaw_rate, wheel_x, wheel_y, cog_height
)
wheel_speed = spin + spin_follow * (cos_steer * change_x + sin_steer * change_y)
wheel_angle = wheel_angle + dt * wheel_speed
hop_rate = hop_rate + hop_free + hop_follow * corner_height(
    dvz, droll_rate, dpitch_rate, seat_x, wheel_y
)
hop = hop + dt * hop_rate
"""

# after the substeps: whether the car still drives
CLOSE = """
yaw = yaw + 6.283185307179586 * math.floor((3.141592653589793 - yaw) * 0.15915494309189535)
in_range = (
    (abs(vx_world) + abs(vy_world) + abs(vz) < 1000.0)
    & (abs(roll_rate) + abs(pitch_rate) + abs(yaw_rate) < 10000.0)
    & (abs(x_cog) + abs(y_cog) + abs(yaw) < 1000000.0)
    & (throttle_command + steering_command == throttle_command + steering_command)
)
upright = abs(roll) + abs(pitch) < 1.5
verdict = (0.0 if upright else 2.0) if in_range else 1.0
"""

# and what others read
FINISH = """
end_sin, end_cos = sin_cos(yaw)
back = cog_to_rear_axle + cog_height * pitch
left = cog_height * roll
x = x_cog - end_cos * back - end_sin * left
y = y_cog - end_sin * back + end_cos * left
z = z_cog - cog_height + pitch * sprung_to_rear_axle
speed, lateral_speed = contact_velocity(
    end_cos * vx_world + end_sin * vy_world, end_cos * vy_world - end_sin * vx_world,
    roll_rate, pitch_rate, yaw_rate, -cog_to_rear_axle, 0.0, cog_height
)
"""

FINISH_WHEEL = """
wheel_steer = atan(wheel_slope)
ground_x = x_cog + end_cos * wheel_x - end_sin * wheel_y
ground_y = y_cog + end_sin * wheel_x + end_cos * wheel_y
"""

NAMES = frozenset(
    re.findall(
        r"[a-z]\w*",
        "".join((START, BODY, WHEEL, FRAME, ROAD, ELIMINATE, SOLVE, ROLL, CLOSE, FINISH)),
    )
)
