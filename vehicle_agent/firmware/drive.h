// From commands in [-1, 1] to what the motor's driver and the servo get.
#pragma once

#include <stdint.h>

#include "settings.h"

inline float clamp_command(float value) {
  if (value > 1.0f) return 1.0f;
  if (value < -1.0f) return -1.0f;
  return value;
}

// A little too much is clamped. What is absurd or no number is no command: of the damaged frames
// that pass rosserial's 8-bit check, nearly all that would move the car carry such a value.
inline bool is_command(float value) {
  return value <= settings::rejected_above && value >= -settings::rejected_above;
}

struct MotorOutput {
  uint8_t pwm;  // of 255
  bool is_reverse;
  bool is_braking;
};

// The published mapping, but a duty that rounds to nothing brakes too.
inline MotorOutput motor_output(float drive) {
  const float size = drive < 0.0f ? -drive : drive;
  const uint8_t pwm = static_cast<uint8_t>(255.0f * clamp_command(size));
  return {pwm, drive < 0.0f && pwm > 0, pwm == 0};
}

// Positive steers left. Where the published firmware cuts to whole degrees, this does not.
inline uint16_t servo_us(float steer) {
  const float deg = settings::servo_centre_deg + settings::servo_throw_deg * clamp_command(steer);
  return static_cast<uint16_t>(
      settings::servo_us_at_0_deg + settings::servo_us_per_deg * deg + 0.5f);
}

// Follows a target no faster than `slew_per_s` (0: at once).
class Slewed {
 public:
  explicit Slewed(float slew_per_s) : slew_per_s_(slew_per_s) {}

  void aim(float target) { target_ = target; }

  float step(uint32_t now_ms) {
    const float most = slew_per_s_ * static_cast<float>(now_ms - stepped_ms_) * 1e-3f;
    stepped_ms_ = now_ms;
    const float way = target_ - value_;
    if (slew_per_s_ <= 0.0f || (way <= most && way >= -most)) {
      value_ = target_;
    } else {
      value_ += way > 0.0f ? most : -most;
    }
    return value_;
  }

 private:
  float slew_per_s_, target_ = 0.0f, value_ = 0.0f;
  uint32_t stepped_ms_ = 0;
};
