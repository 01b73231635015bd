#include "Arduino.h"
Chip chip;
Port Serial;
std::deque<int> asked;
#include "palpate_hx711.ino"

int main() {
  setup();
  for (int i = 0; i < 12; i++) {
    if (i == 7) asked.push_back('?');
    loop();
  }
  return chip.has_slept ? 3 : chip.gain_clocks == (GAIN == 64 ? 27 : 25) ? 0 : 2;
}
