// The MPU-9250: woken when it answers, read every 10 ms, NaN while it does not answer.
#pragma once

#include <math.h>
#include <stdint.h>

#include "settings.h"

struct Motion {
  float gyro_z_radps, accel_x_mps2, accel_y_mps2;  // in the chip's own axes, biases included
};

// `Bus` writes and reads registers over I2C and tells whether the chip answered, in bounded time:
//   bool write(uint8_t address, uint8_t where, uint8_t value);
//   bool read(uint8_t address, uint8_t where, uint8_t* into, uint8_t count);
template <class Bus>
class Imu {
 public:
  explicit Imu(Bus& bus) : bus_(bus) {}

  void step(uint32_t now_ms) {
    if (is_awake_) {
      if (now_ms - stepped_ms_ < settings::imu_period_ms) return;
      stepped_ms_ = now_ms;
      is_awake_ = sample();
    } else if (is_new_ || now_ms - stepped_ms_ >= settings::imu_retry_ms) {
      is_new_ = false;
      stepped_ms_ = now_ms;
      samples_ = 0;
      is_awake_ = wake();
    }
  }

  // Return the mean since the last call, the last mean when no sample came since.
  Motion take() {
    if (!is_awake_) return last_ = {NAN, NAN, NAN};
    if (samples_ > 0) {
      const float share = 1.0f / static_cast<float>(samples_);
      last_ = {gyro_z_ * share * radps_per_bit, accel_x_ * share * mps2_per_bit,
               accel_y_ * share * mps2_per_bit};
      samples_ = 0;
    }
    return last_;
  }

 private:
  static constexpr float radps_per_bit = 250.0f / 32768.0f * 0.017453293f;
  static constexpr float mps2_per_bit = 2.0f / 32768.0f * 9.80665f;
  static constexpr uint8_t who_am_i = 0x75, readings = 0x3B, readings_length = 14;
  static constexpr uint8_t most_samples = 100;

  bool wake() {
    // Clock from the gyro; 41 Hz filters; 200 Hz; +-250 deg/s; +-2 g.
    const uint8_t wanted[][2] = {{0x6B, 0x01}, {0x1A, 0x03}, {0x19, 0x04},
                                 {0x1B, 0x00}, {0x1C, 0x00}, {0x1D, 0x03}};
    uint8_t who = 0;
    if (!bus_.read(settings::imu_address, who_am_i, &who, 1)) return false;
    if (who < 0x70 || who > 0x73) return false;  // MPU-6500, -9250, -9255 and their kin
    for (const auto& pair : wanted) {
      if (!bus_.write(settings::imu_address, pair[0], pair[1])) return false;
    }
    return true;
  }

  bool sample() {
    uint8_t raw[readings_length];
    if (!bus_.read(settings::imu_address, readings, raw, readings_length)) return false;
    if (is_blank(raw)) return false;  // it was reset and sleeps again
    if (samples_ == most_samples) samples_ = 0;
    if (samples_ == 0) gyro_z_ = accel_x_ = accel_y_ = 0.0f;
    accel_x_ += word(raw);
    accel_y_ += word(raw + 2);
    gyro_z_ += word(raw + 12);
    ++samples_;
    return true;
  }

  static bool is_blank(const uint8_t* raw) {
    for (uint8_t at = 0; at < readings_length; ++at) {
      if (raw[at] != 0) return false;
    }
    return true;
  }

  static float word(const uint8_t* high_first) {
    return static_cast<int16_t>(static_cast<uint16_t>((high_first[0] << 8) | high_first[1]));
  }

  Bus& bus_;
  bool is_awake_ = false, is_new_ = true;
  uint8_t samples_ = 0;
  uint32_t stepped_ms_ = 0;
  float gyro_z_ = 0.0f, accel_x_ = 0.0f, accel_y_ = 0.0f;
  Motion last_ = {NAN, NAN, NAN};
};
