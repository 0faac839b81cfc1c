// The whole car without its pins: bytes and time in, what the pins shall do and bytes out.
#pragma once

#include <stdint.h>
#include <string.h>

#include "drive.h"
#include "encoder.h"
#include "frames.h"
#include "imu.h"
#include "lights.h"
#include "session.h"
#include "settings.h"
#include "topics.h"
#include "watchdog.h"

struct Readings {
  int32_t left_ticks, right_ticks;
  Motion motion;
  float battery_v;
};

struct Outputs {
  MotorOutput motor;
  uint16_t servo_us;
  lights::Lamps lamps;
};

class Nigel {
 public:
  explicit Nigel(float steer_slew_per_s = settings::steer_slew_per_s)
      : steer_(steer_slew_per_s) {}

  void receive(uint8_t byte, uint32_t now_ms) {
    frames::Frame frame;
    decoder_.feed(byte, now_ms);
    while (decoder_.next(frame)) receive_frame(frame, now_ms);
  }

  // Return what the pins shall do now. Without a valid drive command for the timeout of
  // settings.h the motor brakes and the servo stays where it was sent.
  Outputs step(uint32_t now_ms) {
    if (!watchdog_.holds(now_ms)) drive_ = 0.0f;
    return {motor_output(drive_), servo_us(steer_.step(now_ms)),
            lights::burning(lights_, drive_, now_ms)};
  }

  // Return whether it is time to `report`.
  bool wants_readings(uint32_t now_ms) const {
    return session_.is_open() && now_ms - reported_ms_ >= settings::telemetry_period_ms;
  }

  // Send the readings; they are left out where an announcement is still on its way.
  void report(const Readings& readings, uint32_t now_ms) {
    const uint32_t late_ms = now_ms - reported_ms_ - settings::telemetry_period_ms;
    reported_ms_ = late_ms < settings::telemetry_period_ms ? now_ms - late_ms : now_ms;
    if (!outbox_.is_empty()) return;
    const float values[] = {wrapped_ticks(readings.left_ticks),
                            wrapped_ticks(readings.right_ticks),
                            readings.motion.gyro_z_radps,
                            readings.motion.accel_x_mps2,
                            readings.motion.accel_y_mps2,
                            readings.battery_v,
                            settings::firmware_version,
                            watchdog_.age_ms(now_ms)};
    outbox_.begin(topics::telemetry);
    outbox_.put_u32(0);  // no dimensions
    outbox_.put_u32(0);  // no offset
    outbox_.put_u32(sizeof values / sizeof values[0]);
    for (const float value : values) outbox_.put_float(value);
    outbox_.finish();
  }

  // Take the next byte for the host, if there is one.
  bool send(uint8_t& byte, uint32_t now_ms) {
    if (outbox_.is_empty() && !session_.write(outbox_, now_ms)) return false;
    return outbox_.take(byte);
  }

 private:
  void receive_frame(const frames::Frame& frame, uint32_t now_ms) {
    if (frame.topic < topics::steer) {
      session_.receive(frame.topic, now_ms);
      return;
    }
    float value;
    if (frame.length != sizeof value) return;
    memcpy(&value, frame.payload, sizeof value);
    if (frame.topic == topics::steer && is_command(value)) {
      steer_.aim(clamp_command(value));
    } else if (frame.topic == topics::drive && is_command(value)) {
      drive_ = clamp_command(value);
      watchdog_.feed(now_ms);
    } else if (frame.topic == topics::light) {
      lights::read(value, lights_);
    }
  }

  frames::Decoder decoder_;
  frames::Outbox outbox_;
  Session session_;
  CommandWatchdog watchdog_;
  Slewed steer_;
  float drive_ = 0.0f;
  uint8_t lights_ = 0;
  uint32_t reported_ms_ = 0;
};
