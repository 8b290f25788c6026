/* Stand-in for the Arduino core in the test of the packages: enough to compile the example. */
#ifndef ARDUINO_H
#define ARDUINO_H
#include <math.h>
#include <stdint.h>
#define constrain(x, low, high) ((x) < (low) ? (low) : ((x) > (high) ? (high) : (x)))
struct SerialPort {
    void begin(unsigned long) {}
    void println(const char *) {}
};
static SerialPort Serial;
static inline uint32_t micros() { static uint32_t now = 0u; return now += 100u; }
static inline void delay(unsigned long) {}
static inline void analogWrite(int, int) {}
void setup();
void loop();
#endif
