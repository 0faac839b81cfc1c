// What a builder may change: pins, scales and rules of this one car. SI units, ms for times.
#pragma once

#include <stdint.h>

namespace settings {

constexpr float firmware_version = 1.0f;
constexpr uint32_t baud = 57600;

// Pins of the published wiring.
constexpr uint8_t left_a_pin = 2, left_b_pin = 4;
constexpr uint8_t right_a_pin = 3, right_b_pin = 5;
constexpr uint8_t pwm_pin = 6, direction_pin = 7, brake_pin = 8;
constexpr uint8_t servo_pin = 9;  // Timer 1's first output: the pulse is made by hardware
constexpr uint8_t tail_pin = 10, low_beam_pin = 11, high_beam_pin = 12, reverse_pin = 13;
constexpr uint8_t left_indicator_pin = 14, right_indicator_pin = 15;  // A0, A1

// The battery's pin is ours: the published wiring measures none.
constexpr bool has_battery_divider = true;  // without one the pin floats: then report NaN
constexpr uint8_t battery_pin = 16;         // A2
constexpr float battery_upper_ohm = 20000.0f, battery_lower_ohm = 10000.0f;
constexpr float adc_reference_v = 5.0f;

// The Servo library's scale, and the published firmware's centre and throw.
constexpr float servo_us_at_0_deg = 544.0f, servo_us_per_deg = (2400.0f - 544.0f) / 180.0f;
constexpr float servo_centre_deg = 97.0f, servo_throw_deg = 30.0f;
constexpr float steer_slew_per_s = 0.0f;  // of the command's range of 2; 0: as fast as it can

// Without a valid drive command for this long the car brakes. The hang reset in firmware.ino is
// another watchdog: it restarts a processor that no longer runs its loop.
constexpr uint16_t command_timeout_ms = 250;
constexpr float rejected_above = 10.0f;  // a larger command is refused and not clamped
constexpr uint8_t telemetry_period_ms = 20;

// Wheels turning forward count up; the two encoders are mounted mirrored.
constexpr int8_t left_sign = 1, right_sign = -1;

constexpr uint8_t imu_address = 0x68;
constexpr uint8_t imu_period_ms = 10;
constexpr uint16_t imu_retry_ms = 1000;

constexpr float brake_light_below = 0.05f;  // of the full drive command
constexpr uint8_t tail_dim = 15, tail_bright = 255;
constexpr uint16_t indicator_half_period_ms = 500;

}  // namespace settings
