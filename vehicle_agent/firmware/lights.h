// Which lamps burn: what the host commands, and what follows from the drive command.
#pragma once

#include <stdint.h>

#include "settings.h"

namespace lights {

constexpr uint8_t low_beam = 1, high_beam = 2, left = 4, right = 8, all = 15;

struct Lamps {
  uint8_t tail;  // of 255
  bool low_beam, high_beam, reverse, left_indicator, right_indicator;
};

// Read the number that `light_cmd` carries into `commanded`; return whether it is one of 0 to 15.
inline bool read(float value, uint8_t& commanded) {
  if (!(value >= 0.0f && value <= all)) return false;
  commanded = static_cast<uint8_t>(value);
  return true;
}

// The high beam burns with the low one; both indicators together are the hazard lights.
inline Lamps burning(uint8_t commanded, float drive, uint32_t now_ms) {
  const bool is_blink = now_ms / settings::indicator_half_period_ms % 2 == 0;
  const bool is_slow =
      drive < settings::brake_light_below && drive > -settings::brake_light_below;
  const bool has_beam = (commanded & (low_beam | high_beam)) != 0;
  const uint8_t dim = has_beam ? settings::tail_dim : 0;
  return {is_slow ? settings::tail_bright : dim,
          has_beam,
          (commanded & high_beam) != 0,
          drive < 0.0f,
          is_blink && (commanded & left) != 0,
          is_blink && (commanded & right) != 0};
}

}  // namespace lights
