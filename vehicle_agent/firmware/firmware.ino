// Nigel's firmware for an Arduino Nano: pins, timers and the loop. What they do is in nigel.h.
#include <Arduino.h>
#include <avr/wdt.h>

#include "nigel.h"
#include "settings.h"
#include "twi.h"

static Nigel nigel;
static Twi twi;
static Imu<Twi> imu(twi);
static volatile int32_t left_ticks = 0, right_ticks = 0;

// After a reset by the watchdog it still runs, at its shortest: stop it before anything else.
void disarm_watchdog() __attribute__((naked, used, section(".init3")));
void disarm_watchdog() {
  MCUSR = 0;
  wdt_disable();
}

static void on_left_edge() {
  left_ticks += encoder_step(PIND & _BV(2), PIND & _BV(4), settings::left_sign);
}

static void on_right_edge() {
  right_ticks += encoder_step(PIND & _BV(3), PIND & _BV(5), settings::right_sign);
}

// Timer 1 makes the servo's pulse, every 20 ms in steps of 0.5 us, without the processor.
static void set_servo(uint16_t width_us) { OCR1A = 2 * width_us - 1; }

static void begin_servo() {
  set_servo(servo_us(0.0f));
  ICR1 = 39999;
  TCCR1A = _BV(COM1A1) | _BV(WGM11);
  TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS11);
  pinMode(settings::servo_pin, OUTPUT);
}

// Timer 2 dims the tail light by interrupts, for its pin's own timer is the servo's.
static void begin_tail() {
  TCCR2A = _BV(WGM21) | _BV(WGM20);
  TCCR2B = _BV(CS22);
}

ISR(TIMER2_OVF_vect) { PORTB |= _BV(2); }
ISR(TIMER2_COMPA_vect) { PORTB &= static_cast<uint8_t>(~_BV(2)); }

static void set_tail(uint8_t brightness) {
  if (brightness == 0 || brightness == 255) {
    TIMSK2 = 0;
    digitalWrite(settings::tail_pin, brightness == 0 ? LOW : HIGH);
  } else {
    OCR2A = brightness;
    TIMSK2 = _BV(TOIE2) | _BV(OCIE2A);
  }
}

static void set_motor(const MotorOutput& motor) {
  if (motor.is_braking) {
    analogWrite(settings::pwm_pin, 0);
    digitalWrite(settings::brake_pin, HIGH);
    return;
  }
  digitalWrite(settings::direction_pin, motor.is_reverse ? HIGH : LOW);
  digitalWrite(settings::brake_pin, LOW);
  analogWrite(settings::pwm_pin, motor.pwm);
}

static void set_lamps(const lights::Lamps& lamps) {
  set_tail(lamps.tail);
  digitalWrite(settings::low_beam_pin, lamps.low_beam);
  digitalWrite(settings::high_beam_pin, lamps.high_beam);
  digitalWrite(settings::reverse_pin, lamps.reverse);
  digitalWrite(settings::left_indicator_pin, lamps.left_indicator);
  digitalWrite(settings::right_indicator_pin, lamps.right_indicator);
}

static void apply(const Outputs& outputs) {
  set_motor(outputs.motor);
  set_servo(outputs.servo_us);
  set_lamps(outputs.lamps);
}

static float battery_v() {
  constexpr float volts_per_bit = settings::adc_reference_v / 1024.0f *
      (settings::battery_upper_ohm + settings::battery_lower_ohm) / settings::battery_lower_ohm;
  if (!settings::has_battery_divider) return NAN;
  return volts_per_bit * analogRead(settings::battery_pin);
}

static Readings read_all() {
  noInterrupts();
  const int32_t left = left_ticks, right = right_ticks;
  interrupts();
  return {left, right, imu.take(), battery_v()};
}

static const uint8_t output_pins[] = {
    settings::brake_pin,    settings::pwm_pin,
    settings::direction_pin, settings::tail_pin,
    settings::low_beam_pin, settings::high_beam_pin,
    settings::reverse_pin,  settings::left_indicator_pin,
    settings::right_indicator_pin};
static const uint8_t input_pins[] = {settings::left_a_pin, settings::left_b_pin,
                                     settings::right_a_pin, settings::right_b_pin};

void setup() {
  for (const uint8_t pin : output_pins) {
    digitalWrite(pin, pin == settings::brake_pin ? HIGH : LOW);
    pinMode(pin, OUTPUT);
  }
  for (const uint8_t pin : input_pins) pinMode(pin, INPUT_PULLUP);
  wdt_enable(WDTO_250MS);  // resets a hung processor; settings::command_timeout_ms is the host's silence
  begin_servo();
  begin_tail();
  attachInterrupt(digitalPinToInterrupt(settings::left_a_pin), on_left_edge, CHANGE);
  attachInterrupt(digitalPinToInterrupt(settings::right_a_pin), on_right_edge, CHANGE);
  twi.begin();
  Serial.begin(settings::baud);
}

void loop() {
  const uint32_t now_ms = millis();
  while (Serial.available() > 0) nigel.receive(static_cast<uint8_t>(Serial.read()), now_ms);
  apply(nigel.step(now_ms));
  imu.step(now_ms);
  if (nigel.wants_readings(now_ms)) nigel.report(read_all(), now_ms);
  uint8_t byte;
  while (Serial.availableForWrite() > 0 && nigel.send(byte, now_ms)) Serial.write(byte);
  wdt_reset();
}
