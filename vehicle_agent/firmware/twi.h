// I2C by the ATmega's own registers. Every wait is bounded: a bus that hangs costs at most some
// hundred microseconds per call, and never the car.
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
    return end(start(address, TW_WRITE) && put(where) && put(value));
  }

  bool read(uint8_t address, uint8_t where, uint8_t* into, uint8_t count) {
    if (!(start(address, TW_WRITE) && put(where) && start(address, TW_READ))) return end(false);
    for (uint8_t left = count; left > 0; --left) {
      if (!go(left > 1 ? _BV(TWEA) : 0)) return end(false);
      *into++ = TWDR;
    }
    return end(true);
  }

 private:
  // Let the hardware do one step; about 300 us at most, where a byte takes 23.
  static bool go(uint8_t how) {
    TWCR = _BV(TWINT) | _BV(TWEN) | how;
    for (uint16_t left = 700; left > 0; --left) {
      if (TWCR & _BV(TWINT)) return true;
    }
    return false;
  }

  static bool start(uint8_t address, uint8_t direction) {
    if (!go(_BV(TWSTA))) return false;
    TWDR = static_cast<uint8_t>(address << 1) | direction;
    return go(0) && TW_STATUS == (direction == TW_READ ? TW_MR_SLA_ACK : TW_MT_SLA_ACK);
  }

  static bool put(uint8_t byte) {
    TWDR = byte;
    return go(0) && TW_STATUS == TW_MT_DATA_ACK;
  }

  static bool end(bool is_good) {
    TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
    for (uint8_t left = 200; left > 0 && (TWCR & _BV(TWSTO)); --left) {
    }
    if (!is_good) TWCR = 0;
    return is_good;
  }
};
