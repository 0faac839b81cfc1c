// What car and host exchange besides commands: who receives, and whether it is still there.
#pragma once

#include <stdint.h>

#include "frames.h"
#include "topics.h"

// A host asks for the topics once. From then on its time is requested every 2.5 s, and taken
// for gone when it has not answered for 11 s; all as in rosserial.
class Session {
 public:
  static constexpr uint16_t request_period_ms = 2500, gone_after_ms = 11000;

  bool is_open() const { return is_open_; }

  void receive(uint16_t topic, uint32_t now_ms) {
    if (topic == topics::publisher_info) {
      is_open_ = true;
      is_requesting_ = true;
      announced_ = 0;
      answered_ms_ = now_ms;
    } else if (topic == topics::time) {
      answered_ms_ = now_ms;
    } else if (topic == topics::tx_stop) {
      is_open_ = false;
    }
  }

  // Write what is due, if anything; return whether something was.
  bool write(frames::Outbox& outbox, uint32_t now_ms) {
    if (is_open_ && now_ms - answered_ms_ > gone_after_ms) is_open_ = false;
    if (!is_open_) return false;
    if (is_requesting_ || now_ms - requested_ms_ > request_period_ms) {
      is_requesting_ = false;
      requested_ms_ = now_ms;
      outbox.begin(topics::time);
      outbox.put_u32(0);
      outbox.put_u32(0);
      outbox.finish();
      return true;
    }
    if (announced_ == topics::count) return false;
    topics::announce(outbox, announced_++);
    return true;
  }

 private:
  bool is_open_ = false, is_requesting_ = false;
  uint8_t announced_ = topics::count;
  uint32_t requested_ms_ = 0, answered_ms_ = 0;
};
