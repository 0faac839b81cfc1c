// rosserial's frames: FF FE | length | check of length | topic | payload | check of both.
// Lengths and topics are u16, all is little endian, a check is 255 - sum modulo 256.
#pragma once

#include <stdint.h>
#include <string.h>

namespace frames {

constexpr uint8_t head = 5, around = 8;
constexpr uint8_t byte_timeout_ms = 20;  // rosserial's own

struct Frame {
  uint16_t topic;
  uint16_t length;         // of the payload [bytes]
  const uint8_t* payload;  // lent until the next byte
};

inline uint8_t check(const uint8_t* bytes, uint8_t count) {
  uint8_t sum = 0;
  while (count-- > 0) sum += *bytes++;
  return 255 - sum;
}

inline uint16_t u16_at(const uint8_t* bytes) {
  return static_cast<uint16_t>(bytes[0] | (bytes[1] << 8));
}

// Frames out of a stream of bytes, whatever else is in it. A frame that fails a check is given up
// by one byte only, so that nothing which begins inside it is lost; one that pauses for longer
// than `byte_timeout_ms` is given up whole. Feed one byte, then take frames until there is none.
class Decoder {
 public:
  static constexpr uint8_t longest = 32;  // of a payload [bytes]; a longer one is no frame to us

  void feed(uint8_t byte, uint32_t now_ms) {
    settle();
    if (now_ms - came_ms_ > byte_timeout_ms) count_ = 0;
    came_ms_ = now_ms;
    held_[count_++] = byte;
  }

  bool next(Frame& frame) {
    settle();
    while (count_ > 0) {
      switch (look()) {
        case Look::broken:
          drop(1);
          break;
        case Look::unfinished:
          return false;
        case Look::whole:
          frame = {u16_at(held_ + head), u16_at(held_ + 2), held_ + head + 2};
          lent_ = static_cast<uint8_t>(around + frame.length);
          return true;
      }
    }
    return false;
  }

 private:
  enum class Look : uint8_t { broken, unfinished, whole };

  Look look() const {
    if (held_[0] != 0xFF) return Look::broken;
    if (count_ > 1 && held_[1] != 0xFE) return Look::broken;
    if (count_ < head) return Look::unfinished;
    const uint16_t length = u16_at(held_ + 2);
    if (held_[4] != check(held_ + 2, 2) || length > longest) return Look::broken;
    if (count_ < around + length) return Look::unfinished;
    const uint8_t body = static_cast<uint8_t>(2 + length);
    return held_[head + body] == check(held_ + head, body) ? Look::whole : Look::broken;
  }

  void drop(uint8_t count) {
    count_ = static_cast<uint8_t>(count_ - count);
    memmove(held_, held_ + count, count_);
  }

  void settle() {
    drop(lent_);
    lent_ = 0;
  }

  uint8_t held_[around + longest];
  uint8_t count_ = 0, lent_ = 0;
  uint32_t came_ms_ = 0;
};

// One frame on its way out, read byte by byte as the port takes them: nothing ever waits for it.
class Outbox {
 public:
  static constexpr uint8_t capacity = 104;  // the longest announcement takes 93

  bool is_empty() const { return at_ == end_; }

  void begin(uint16_t topic) {
    end_ = 0;
    put_u16(0xFEFF);
    put_u16(0);
    put(0);
    put_u16(topic);
    at_ = end_;
  }

  void put(uint8_t byte) { held_[end_++] = byte; }

  void put_u16(uint16_t value) {
    put(static_cast<uint8_t>(value));
    put(static_cast<uint8_t>(value >> 8));
  }

  void put_u32(uint32_t value) {
    put_u16(static_cast<uint16_t>(value));
    put_u16(static_cast<uint16_t>(value >> 16));
  }

  void put_float(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(bits);
  }

  void finish() {
    held_[2] = static_cast<uint8_t>(end_ - head - 2);
    held_[4] = check(held_ + 2, 2);
    put(check(held_ + head, static_cast<uint8_t>(end_ - head)));
    at_ = 0;
  }

  bool take(uint8_t& byte) {
    if (is_empty()) return false;
    byte = held_[at_++];
    return true;
  }

 private:
  uint8_t held_[capacity];
  uint8_t at_ = 0, end_ = 0;
};

}  // namespace frames
