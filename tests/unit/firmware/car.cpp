// The firmware's car without its board, behind plain functions that a test can call.
#include <stdint.h>

#include "nigel.h"

namespace {

Nigel* car = nullptr;

struct FakeBus {
  uint8_t registers[128] = {};
  bool answers = false;
  unsigned reads = 0;

  bool write(uint8_t address, uint8_t where, uint8_t value) {
    if (!answers || address != settings::imu_address) return false;
    registers[where] = value;
    return true;
  }

  bool read(uint8_t address, uint8_t where, uint8_t* into, uint8_t count) {
    if (!answers || address != settings::imu_address) return false;
    ++reads;
    memcpy(into, registers + where, count);
    return true;
  }
};

FakeBus bus;
Imu<FakeBus>* imu = nullptr;

}  // namespace

extern "C" {

void car_new(float steer_slew_per_s) {
  delete car;
  car = new Nigel(steer_slew_per_s);
}

void car_receive(const uint8_t* bytes, uint32_t count, uint32_t now_ms) {
  for (uint32_t at = 0; at < count; ++at) car->receive(bytes[at], now_ms);
}

void car_step(uint32_t now_ms, int32_t* out) {
  const Outputs outputs = car->step(now_ms);
  const int32_t all[] = {outputs.motor.pwm,       outputs.motor.is_reverse,
                         outputs.motor.is_braking, outputs.servo_us,
                         outputs.lamps.tail,       outputs.lamps.low_beam,
                         outputs.lamps.high_beam,  outputs.lamps.reverse,
                         outputs.lamps.left_indicator, outputs.lamps.right_indicator};
  memcpy(out, all, sizeof all);
}

uint32_t car_send(uint8_t* into, uint32_t most, uint32_t now_ms) {
  uint32_t count = 0;
  while (count < most && car->send(into[count], now_ms)) ++count;
  return count;
}

void car_tell(int32_t left, int32_t right, float battery_v, uint32_t now_ms) {
  if (car->wants_readings(now_ms)) {
    car->report({left, right, {0.5f, 1.0f, -2.0f}, battery_v}, now_ms);
  }
}

// Return how many frames a fresh decoder finds; their topics and lengths go to `found`.
uint32_t decode(const uint8_t* bytes, uint32_t count, uint16_t* found, uint32_t most) {
  frames::Decoder decoder;
  frames::Frame frame;
  uint32_t frames_found = 0;
  for (uint32_t at = 0; at < count; ++at) {
    decoder.feed(bytes[at], 0);
    while (decoder.next(frame) && frames_found < most) {
      found[2 * frames_found] = frame.topic;
      found[2 * frames_found++ + 1] = frame.length;
    }
  }
  return frames_found;
}

float ticks_as_told(int32_t ticks) { return wrapped_ticks(ticks); }

int32_t one_step(int32_t a, int32_t b, int32_t sign) {
  return encoder_step(a != 0, b != 0, static_cast<int8_t>(sign));
}

void imu_new(int32_t answers) {
  delete imu;
  bus = FakeBus();
  bus.answers = answers != 0;
  imu = new Imu<FakeBus>(bus);
}

void imu_answers(int32_t answers) { bus.answers = answers != 0; }

void imu_set(uint8_t where, uint8_t value) { bus.registers[where] = value; }

uint8_t imu_get(uint8_t where) { return bus.registers[where]; }

uint32_t imu_reads() { return bus.reads; }

void imu_step(uint32_t now_ms) { imu->step(now_ms); }

void imu_take(float* out) {
  const Motion motion = imu->take();
  out[0] = motion.gyro_z_radps;
  out[1] = motion.accel_x_mps2;
  out[2] = motion.accel_y_mps2;
}

}  // extern "C"
