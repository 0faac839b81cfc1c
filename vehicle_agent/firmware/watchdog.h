// How old the last valid drive command is, and whether it may still be obeyed.
#pragma once

#include <math.h>
#include <stdint.h>

#include "settings.h"

class CommandWatchdog {
 public:
  void feed(uint32_t now_ms) {
    fed_ms_ = now_ms;
    has_command_ = true;
  }

  // Return whether the last command is still valid. Call it more often than the clock wraps
  // (49.7 days), and forget the command when it is not.
  bool holds(uint32_t now_ms) const {
    return has_command_ && now_ms - fed_ms_ < settings::command_timeout_ms;
  }

  // Return the command's age [ms], NaN before the first one.
  float age_ms(uint32_t now_ms) const {
    return has_command_ ? static_cast<float>(now_ms - fed_ms_) : NAN;
  }

 private:
  uint32_t fed_ms_ = 0;
  bool has_command_ = false;
};
