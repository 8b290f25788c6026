// Moves a motor between two angles. Fill in the functions marked BOARD: encoder, current loop, driver.
//
// Export your own motor first, into src/edo_smc_drive.h of this library (README).
#include <Arduino.h>
#include <EdoSmcDrive.h>

static EdoSmcDrive drive;
static uint32_t last_us;

// BOARD: returns the raw counter register of the encoder.
static uint32_t encoderCount() { return 0u; }

// BOARD: returns the electrical angle from the count: pole pairs, and the offset of your alignment.
static float electricalAngle(uint32_t count) {
  const float polePairs = 7.0f;
  return polePairs * (float)(count & 16383u) * (6.2831853f / 16384.0f);
}

// BOARD: the current loop (FOC). This placeholder sets a voltage for the q axis from a resistance, without a current
// measurement. Use a real current loop, as in SimpleFOC's torque mode foc_current. Returns the current that it holds.
static float commandCurrent(float ampere, uint32_t count) {
  const float resistance_ohm = 0.5f;
  const float supply_v = 12.0f;
  const float limit_a = 0.5f * supply_v / resistance_ohm;
  const float held = constrain(ampere, -limit_a, limit_a);
  const float q_v = held * resistance_ohm;
  const float angle = electricalAngle(count);
  const int pins[3] = {9, 10, 11};
  for (int phase = 0; phase < 3; phase++) {
    const float volt = -q_v * sinf(angle - 2.0943951f * (float)phase);
    analogWrite(pins[phase], (int)((0.5f + volt / supply_v) * 255.0f));
  }
  return held;
}

// A control period. Call it from a hardware timer every drive.period(); loop() polls the clock here.
static void controlTick() {
  const uint32_t count = encoderCount();
  const float ampere = drive.tick(count);
  const float held = commandCurrent(ampere, count);
  if (held < ampere || held > ampere) {
    drive.applied(held);
  }
}

void setup() {
  Serial.begin(115200);
  if (!drive.begin()) {
    Serial.println("floating-point modes are not the assumed ones");
  }
  last_us = micros();
}

void loop() {
  static bool there = false;
  const uint32_t period_us = (uint32_t)(drive.period() * 1e6 + 0.5);
  const uint32_t due = (micros() - last_us) / period_us;
  if (due > 0u) {
    last_us += due * period_us;
    if (due > 1u) {
      drive.missed(due - 1u);
    }
    controlTick();
  }
  if (drive.hasStopped()) {
    Serial.println("stopped by an alarm");
    commandCurrent(0.0f, encoderCount());
    delay(1000);
  } else if (drive.hasStarted() && !drive.isMoving()) {
    there = !there;
    drive.moveTo(there ? 1.0 : 0.0, 0.5);
  }
}
