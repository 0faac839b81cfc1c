"""Chapters of effects for people, by what they act on."""

from scm.vehicles.term import Term

OTHERS = "Others"
CHAPTERS: tuple[tuple[str, frozenset[str]], ...] = (
    ("Throttle and motors", frozenset({
        "throttle_received", "throttle_limited", "throttle_live", "throttle_curved",
        "throttle_scaled", "throttle", "motor_throttle", "fade_strength", "warm_strength",
        "motor_strength", "motor_heat", "wheel_torque",
        "extra_inertia"})),
    ("Battery", frozenset({
        "charge_drawn", "open_circuit_voltage", "terminal_voltage", "supply_voltage"})),
    ("Steering", frozenset({
        "steering_received", "steering", "steer_demand", "steer_scaled", "steer_target",
        "servo_load_pace", "servo_pace", "servo_angle", "linkage_angle", "steer_trimmed",
        "steer_yielded", "steer_angle", "road_angle", "wheel_steer", "wheel_slope"})),
    ("Tyres and floor", frozenset({
        "tyre_x", "tyre_y", "grip_load", "grip_here", "grip", "rolling", "slip_scale", "side_lag",
        "side_lag_speed", "spin_lag", "spin_lag_speed"})),
    ("Friction that holds and brakes", frozenset({"dry_torque"})),
    ("Body", frozenset({
        "force_x", "force_y", "moment_z", "added_mass", "added_cog_x", "added_cog_z"})),
    ("Suspension", frozenset({"suspension_force", "load"})),
)  # fmt: skip


def chapter_of(term: Term) -> str:
    """Return the heading of an effect."""
    return next((title for title, targets in CHAPTERS if term.target in targets), OTHERS)
