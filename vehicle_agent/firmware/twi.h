// I2C by the ATmega's own registers. Every wait is bounded: a bus that hangs costs a millisecond
// per call at most, and never the car.
#pragma once

#include <Arduino.h>
#include <util/twi.h>

class Twi {
 public:
  // Free a chip that holds the data line after a reset in mid-byte, then start at 400 kHz.
  void begin() {
    pinMode(SDA, INPUT_PULLUP);
    for (uint8_t pulse = 0; pulse < 9; ++pulse) {
      pinMode(SCL, OUTPUT);
      digitalWrite(SCL, LOW);
      delayMicroseconds(5);
      pinMode(SCL, INPUT_PULLUP);
      delayMicroseconds(5);
    }
    TWSR = 0;
    TWBR = (F_CPU / 400000UL - 16) / 2;
  }

  bool write(uint8_t address, uint8_t where, uint8_t value) {
    return end(start(address, TW_WRITE, TW_START) && put(where) && put(value));
  }

  bool read(uint8_t address, uint8_t where, uint8_t* into, uint8_t count) {
    if (!(start(address, TW_WRITE, TW_START) && put(where) &&
          start(address, TW_READ, TW_REP_START))) {
      return end(false);
    }
    for (uint8_t left = count; left > 0; --left) {
      if (left > 1 ? !go(_BV(TWEA), TW_MR_DATA_ACK) : !go(0, TW_MR_DATA_NACK)) return end(false);
      *into++ = TWDR;
    }
    return end(true);
  }

 private:
  // Let the hardware do one step and return whether it ended as `wanted`; 0.7 ms at most, where a
  // byte takes 0.023.
  static bool go(uint8_t how, uint8_t wanted, uint8_t or_else) {
    TWCR = _BV(TWINT) | _BV(TWEN) | how;
    for (uint16_t left = 700; left > 0; --left) {
      if ((TWCR & _BV(TWINT)) && (TW_STATUS == wanted || TW_STATUS == or_else)) {
        return true;
      }
    }
    return false;
  }

  static bool go(uint8_t how, uint8_t wanted) { return go(how, wanted, wanted); }

  static bool start(uint8_t address, uint8_t direction, uint8_t wanted) {
    if (!go(_BV(TWSTA), wanted)) return false;
    TWDR = static_cast<uint8_t>(address << 1) | direction;
    if (direction == TW_READ) return go(0, TW_MR_SLA_ACK);
    return go(0, TW_MT_SLA_ACK, TW_MT_DATA_ACK);  // simavr 1.6 tells the second of an address
  }

  static bool put(uint8_t value) {
    TWDR = value;
    return go(0, TW_MT_DATA_ACK);
  }

  static bool end(bool is_good) {
    TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
    for (uint8_t left = 200; left > 0 && (TWCR & _BV(TWSTO)); --left) {
    }
    if (!is_good) TWCR = 0;
    return is_good;
  }
};
