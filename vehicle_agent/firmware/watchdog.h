// How old the last valid drive command is, and whether it may still be obeyed.
#pragma once

#include <math.h>
#include <stdint.h>

#include "settings.h"

class CommandWatchdog {
 public:
  void feed(uint32_t now_ms) {
    fed_ms_ = now_ms;
    has_heard_ = true;
  }

  // Return whether the last command still holds. Ask more often than the clock wraps (49.7 days)
  // and forget the command when it does not.
  bool holds(uint32_t now_ms) const {
    return has_heard_ && now_ms - fed_ms_ < settings::command_patience_ms;
  }

  // Return the command's age [ms], NaN before the first one.
  float age_ms(uint32_t now_ms) const {
    return has_heard_ ? static_cast<float>(now_ms - fed_ms_) : NAN;
  }

 private:
  uint32_t fed_ms_ = 0;
  bool has_heard_ = false;
};
