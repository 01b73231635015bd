// As much of an Arduino as the skeleton of a sidecar needs, on this computer: Serial is a pseudo-terminal, and the clock is that
// of the computer, a little fast. `main.cpp` runs it.
//
// SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

unsigned long micros();
unsigned long millis();
inline int analogRead(int) { return std::rand() & 1023; }
inline void randomSeed(unsigned long seed) { std::srand(seed); }
inline long random(long from, long to) { return from + std::rand() % (to - from); }
using std::fabs;
using std::lround;
using std::sqrt;

struct Port {
  void begin(unsigned long) {}
  int available();
  int read();
  void write(char c);
};
extern Port Serial;
