// Reads an HX711 load cell converter and sends its counts to palpate. For any Arduino.
//
// SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
//
// Wire DOUT and PD_SCK (called DT and SCK on most boards) to the pins below, and set the gain and a name for the board.
// 80 conversions a second need the chip's RATE pin at its supply; most boards are sold with it at ground, 10 a second.
//
// Lines, 115200 baud, CR LF at the end, CRC-16/CCITT-FALSE of all before the star behind it:
//   B,<micros>,palpate-hx711,1,<rate>,<gain>,<board>*<crc>   started
//   H,<micros>,palpate-hx711,1,<rate>,<gain>,<board>*<crc>   the answer to ?
//   D,<micros>,<count>*<crc>                                 one conversion, stamped when it was ready
//   E,<micros>,missing*<crc>                                 no conversion for half a second
// The timing of the chip's pins is in the HX711 data sheet, Avia Semiconductor, pages 4 and 5.

const byte DOUT_PIN = 3;
const byte SCK_PIN = 2;
const byte GAIN = 128;             // of channel A: 128 or 64
const char BOARD[] = "board-1";    // 1 to 16 letters, digits, - and _

const unsigned long MISSING_AFTER_US = 500000UL;
// The first conversions after a start are not settled (data sheet, page 3).
const byte SETTLING = 4;
// Between 12.5 ms and 100 ms of a conversion.
const unsigned long SLOW_US = 35000UL;

uint16_t sum;
byte rate = 0;

void put(char c) {
  sum ^= (uint16_t)(byte)c << 8;
  for (byte i = 0; i < 8; i++) {
    sum = sum & 0x8000 ? (uint16_t)(sum << 1) ^ 0x1021 : (uint16_t)(sum << 1);
  }
  Serial.write(c);
}

void put(const char *text) {
  while (*text) {
    put(*text++);
  }
}

void putUnsigned(unsigned long value) {
  char digits[11];
  byte at = sizeof digits - 1;
  digits[at] = 0;
  do {
    digits[--at] = '0' + value % 10;
    value /= 10;
  } while (value);
  put(digits + at);
}

void begin(char kind, unsigned long at) {
  sum = 0xFFFF;
  put(kind);
  put(',');
  putUnsigned(at);
  put(',');
}

void end() {
  const uint16_t whole = sum;
  Serial.write('*');
  for (int8_t shift = 12; shift >= 0; shift -= 4) {
    Serial.write("0123456789ABCDEF"[whole >> shift & 15]);
  }
  Serial.write("\r\n");
}

void header(char kind) {
  begin(kind, micros());
  put("palpate-hx711,1,");
  putUnsigned(rate);
  put(',');
  putUnsigned(GAIN);
  put(',');
  put(BOARD);
  end();
}

// Waits for the next conversion, answering questions meanwhile. False when there is none in time.
bool isReady(unsigned long &at) {
  const unsigned long start = micros();
  while (digitalRead(DOUT_PIN) == HIGH) {
    if (micros() - start > MISSING_AFTER_US) {
      return false;
    }
    while (Serial.available() > 0) {
      if (Serial.read() == '?') {
        header('H');
      }
    }
  }
  at = micros();
  return true;
}

// 24 bits, the highest first; 25 clocks choose gain 128 for the next conversion, 27 gain 64. Within a clock no interrupt
// may keep PD_SCK high for more than 60 us, or the chip goes to sleep.
long readCount() {
  unsigned long bits = 0;
  const byte clocks = GAIN == 64 ? 27 : 25;
  for (byte i = 0; i < clocks; i++) {
    noInterrupts();
    digitalWrite(SCK_PIN, HIGH);
    delayMicroseconds(1);
    const bool isOne = digitalRead(DOUT_PIN) == HIGH;
    digitalWrite(SCK_PIN, LOW);
    interrupts();
    delayMicroseconds(1);
    if (i < 24) {
      bits = bits << 1 | (isOne ? 1 : 0);
    }
  }
  if (bits & 0x800000UL) {
    bits |= 0xFF000000UL;
  }
  return (long)(int32_t)bits;
}

// Lets the chip settle and sees how fast it is.
bool settle() {
  unsigned long before = 0;
  unsigned long now = 0;
  for (byte i = 0; i < SETTLING; i++) {
    before = now;
    if (!isReady(now)) {
      return false;
    }
    readCount();
  }
  rate = now - before > SLOW_US ? 10 : 80;
  return true;
}

void missing() {
  rate = 0;
  begin('E', micros());
  put("missing");
  end();
}

void setup() {
  Serial.begin(115200);
  pinMode(SCK_PIN, OUTPUT);
  digitalWrite(SCK_PIN, LOW);
  pinMode(DOUT_PIN, INPUT_PULLUP);
  while (!settle()) {
    missing();
  }
  header('B');
}

void loop() {
  unsigned long at;
  if (!isReady(at)) {
    missing();
    while (!settle()) {
      missing();
    }
    return;
  }
  const long count = readCount();
  begin('D', at);
  if (count < 0) {
    put('-');
  }
  putUnsigned(count < 0 ? -(unsigned long)count : (unsigned long)count);
  end();
}
