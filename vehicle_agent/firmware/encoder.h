// A wheel's encoder, counted at each edge of its channel A (x2), as in the published test sketch.
#pragma once

#include <stdint.h>

// Return the count that an edge of channel A is worth, from both channels just after it.
inline int8_t encoder_step(bool a, bool b, int8_t sign) {
  return a == b ? static_cast<int8_t>(-sign) : sign;
}

// A float32 holds whole numbers up to 2^24 only: tell the count wrapped to [-2^23, 2^23), exactly.
inline float wrapped_ticks(int32_t ticks) {
  const int32_t low = static_cast<int32_t>(static_cast<uint32_t>(ticks) & 0xFFFFFFu);
  return static_cast<float>(low >= 0x800000 ? low - 0x1000000 : low);
}
