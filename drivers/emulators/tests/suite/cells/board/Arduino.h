// As much of an Arduino as palpate's sketch needs, with an HX711 on two of its pins, in time that reading the clock makes.
#pragma once
#include <cstdint>
#include <cstdio>
#include <deque>

typedef uint8_t byte;
const int HIGH = 1, LOW = 0, OUTPUT = 1, INPUT_PULLUP = 2;

struct Chip {
  static const unsigned long period = 12400;
  unsigned long now = 0, ready = period, rise = 0;
  // What it measures next; after a whole reading the next one.
  long counts[6] = {0, 8388607, -8388608, -1, 152034, -152034};
  int at = -5, clocks = 0, gain_clocks = 0;
  bool is_lost = false, has_slept = false, sck = false;
  bool dout() const {
    if (is_lost || now < ready) return true;
    if (clocks == 0) return false;
    if (clocks > 24) return true;
    const long count = at < 0 ? 77 : counts[at % 6];
    return count >> (24 - clocks) & 1;
  }
  void clock(bool high) {
    if (high && !sck) { clocks++; rise = now; }
    if (!high && sck && now - rise > 60) has_slept = true;
    sck = high;
  }
  // Between two readings: the clocks of the last one chose the gain.
  void settle() {
    if (clocks > 0 && now > rise + 20) { gain_clocks = clocks; clocks = 0; at++; while (ready <= now) ready += period; }
  }
};

extern Chip chip;
extern std::deque<int> asked;

inline unsigned long micros() { chip.now += 4; chip.settle(); return chip.now; }
inline void delayMicroseconds(unsigned us) { chip.now += us; }
inline void noInterrupts() {}
inline void interrupts() {}
inline void pinMode(byte, int) {}
inline void digitalWrite(byte, int level) { chip.clock(level == HIGH); }
inline int digitalRead(byte) { return chip.dout() ? HIGH : LOW; }

struct Port {
  void begin(unsigned long) {}
  int available() { return (int)asked.size(); }
  int read() { int c = asked.front(); asked.pop_front(); return c; }
  void write(char c) { putchar(c); chip.now += 87; chip.settle(); }
  void write(const char *text) { while (*text) write(*text++); }
};
extern Port Serial;
