// How old the last valid drive command is, and whether it may still be obeyed.
#pragma once

#include <math.h>
#include <stdint.h>

#include "settings.h"

class CommandWatchdog {
 public:
  void feed(uint32_t now_ms) {
    fed_ms_ = now_ms;
    is_fed_ = has_heard_ = true;
  }

  // Return whether the last command still holds. Once it does not, only a new one helps: the
  // clock's wrap after 49.7 days brings nothing back.
  bool holds(uint32_t now_ms) {
    if (now_ms - fed_ms_ >= settings::command_patience_ms) is_fed_ = false;
    return is_fed_;
  }

  // Return the command's age [ms], NaN before the first one.
  float age_ms(uint32_t now_ms) const {
    return has_heard_ ? static_cast<float>(now_ms - fed_ms_) : NAN;
  }

 private:
  uint32_t fed_ms_ = 0;
  bool is_fed_ = false, has_heard_ = false;
};
