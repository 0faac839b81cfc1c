// The topics that the host learns of: the published firmware's two, and ours.
#pragma once

#include <stdint.h>

#include "frames.h"

#ifdef __AVR__
#include <avr/pgmspace.h>
#else
#define PROGMEM
inline uint8_t pgm_read_byte(const char* at) { return static_cast<uint8_t>(*at); }
#endif

namespace topics {

// Numbers with a meaning of their own.
constexpr uint16_t publisher_info = 0, subscriber_info = 1, time = 10, tx_stop = 11;

constexpr uint16_t steer = 100, drive = 101, light = 102, telemetry = 125;
constexpr uint8_t count = 4;

const char steer_name[] PROGMEM = "steer_cmd";
const char drive_name[] PROGMEM = "drive_cmd";
const char light_name[] PROGMEM = "light_cmd";
const char telemetry_name[] PROGMEM = "telemetry";
const char float_kind[] PROGMEM = "std_msgs/Float32";
const char float_md5[] PROGMEM = "73fcbf46b49191e672908e50842a83d4";
const char floats_kind[] PROGMEM = "std_msgs/Float32MultiArray";
const char floats_md5[] PROGMEM = "6a40e0ffa6a17a503ac3f8616991b1f6";

inline void put_text(frames::Outbox& outbox, const char* text) {
  uint8_t length = 0;
  while (pgm_read_byte(text + length) != 0) ++length;
  outbox.put_u32(length);
  for (uint8_t at = 0; at < length; ++at) outbox.put(pgm_read_byte(text + at));
}

// Write the announcement of the topic at `index`, 0 to count - 1.
inline void announce(frames::Outbox& outbox, uint8_t index) {
  const bool is_published = index == 0;
  const char* const names[count] = {telemetry_name, steer_name, drive_name, light_name};
  outbox.begin(is_published ? publisher_info : subscriber_info);
  outbox.put_u16(is_published ? telemetry : static_cast<uint16_t>(steer + index - 1));
  put_text(outbox, names[index]);
  put_text(outbox, is_published ? floats_kind : float_kind);
  put_text(outbox, is_published ? floats_md5 : float_md5);
  outbox.put_u32(is_published ? frames::Outbox::capacity : frames::Decoder::longest);
  outbox.finish();
}

}  // namespace topics
