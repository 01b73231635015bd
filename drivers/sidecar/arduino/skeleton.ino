// my-sidecar: a stage with a load cell for palpate, for any Arduino or ESP32. As it is, stage and cell are simulated: replace the
// lines that are marked. It uses no library but Serial, and no memory beside what is declared here.
//
// SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
//
// The sidecar protocol is in palpate's documents, "The sidecar protocol". Every line has a CRC-16, because it is a serial line.

const char NAME[] = "my-sidecar";
const unsigned long BAUD = 115200;
const int RATE = 100;                    // samples a second
const unsigned long SILENCE_MS = 200;    // the axis brakes by itself after so long without a line
const float MM_PER_PULSE = 0.0025f;
const float TRAVEL_MM = 60.0f;
const float SPEED_MAX = 10.0f;           // mm/s
const float ACCELERATION = 50.0f;        // mm/s2
const float HOME_MM = -5.0f;             // where the home switch closes, from where the board was switched on

enum { MOVING = 1, STOPPING = 2, HOME = 4, MOTOR_ON = 32 };

char line[208];
unsigned length = 0;
bool isTooLong = false, hasGreeted = false, isSending = false, isMotorOn = false;
uint32_t boot, heardMs = 0, dueUs = 0;
uint16_t sum;

// The motion under way: a trapezoid of speed from startMm to endMm, or the braking at its end.
float startMm = 0, endMm = 0, topSpeed = 0, entrySpeed = 0, acceleration = 1, seconds = 0;
uint32_t begunUs = 0;
bool isMoving = false, isStopping = false;

// ---- The stage. REPLACE what is simulated here with your drive, your switches and your load cell.

float elapsed() { return (uint32_t)(micros() - begunUs) * 1e-6f; }

// Position in mm and velocity in mm/s now.
float positionMm(float *velocity) {
  const float t = elapsed(), sign = endMm < startMm ? -1.0f : 1.0f, a = acceleration;
  *velocity = 0;
  if (!isMoving || t >= seconds) return endMm;
  if (isStopping) {
    *velocity = sign * (entrySpeed - a * t);
    return startMm + sign * (entrySpeed * t - a * t * t / 2);
  }
  const float ramp = topSpeed / a;
  if (t < ramp) {
    *velocity = sign * a * t;
    return startMm + sign * a * t * t / 2;
  }
  if (t > seconds - ramp) {
    *velocity = sign * a * (seconds - t);
    return endMm - sign * a * (seconds - t) * (seconds - t) / 2;
  }
  *velocity = sign * topSpeed;
  return startMm + sign * topSpeed * (t - ramp / 2);
}

float nowMm() {
  float velocity;
  return positionMm(&velocity);
}

void enableMotor() { isMotorOn = true; }

void beginMove(float toMm, float speed, float a) {
  startMm = nowMm();
  endMm = toMm;
  const float way = fabs(endMm - startMm), most = sqrt(way * a);
  acceleration = a;
  topSpeed = speed < most ? speed : most;
  isStopping = false;
  isMoving = way > 0;
  seconds = isMoving ? way / topSpeed + topSpeed / a : 0;
  begunUs = micros();
}

void brake() {
  if (!isMoving || isStopping) return;
  float velocity;
  startMm = positionMm(&velocity);
  entrySpeed = fabs(velocity);
  endMm = startMm + (velocity < 0 ? -1 : 1) * entrySpeed * entrySpeed / (2 * acceleration);
  seconds = entrySpeed / acceleration;
  begunUs = micros();
  isStopping = true;
}

void cut() {
  endMm = nowMm();
  isMoving = false;
}

bool isHome() { return nowMm() <= HOME_MM; }

// 24 bits of 5 V: at rest 1.28 V, and a spring of 0.2 N/mm at 20 mm, 0.4 V/N.
long readCounts() {
  const float mm = nowMm(), force = mm > 20 ? (mm - 20) * 0.2f : 0;
  const float noise = (random(-500, 501)) * 1e-6f;
  return (long)((1.28f + 0.4f * force + noise) * (8388608.0f / 5.0f));
}

float readTemperature() { return 21.5f; }

// ---- The protocol. Nothing below needs to be changed.

void put(char c) {
  sum ^= (uint16_t)(uint8_t)c << 8;
  for (int i = 0; i < 8; i++) sum = sum & 0x8000 ? (uint16_t)(sum << 1) ^ 0x1021 : (uint16_t)(sum << 1);
  Serial.write(c);
}

void put(const char *text) { while (*text) put(*text++); }

void putUnsigned(uint32_t value) {
  char digits[11];
  int at = sizeof digits - 1;
  digits[at] = 0;
  do {
    digits[--at] = '0' + value % 10;
    value /= 10;
  } while (value);
  put(digits + at);
}

void putWhole(int32_t value) {
  if (value < 0) put('-');
  putUnsigned(value < 0 ? -(uint32_t)value : (uint32_t)value);
}

// With nine significant digits, which give a float back as it is. JSON has no number for what is none.
void putReal(float value) {
  if (!(value - value == 0)) return put("null");
  if (value < 0) put('-');
  value = fabs(value);
  int tens = 0;
  for (; value >= 1e9f; tens++) value /= 10;
  for (; value > 0 && value < 1e-9f; tens--) value *= 10;
  // The value is whole * 2^-places exactly, and so is each of its digits: whole has 24 bits, and places are at most 54.
  int exponent;
  uint64_t whole = (uint64_t)ldexp(frexp(value, &exponent), 24);
  int places = 24 - exponent;
  for (; places < 0; places++) whole *= 2;
  const uint32_t before = (uint32_t)(whole >> places);
  uint64_t rest = whole - ((uint64_t)before << places);
  putUnsigned(before);
  int digits = 0;
  for (uint32_t left = before; left; left /= 10) digits++;
  if (rest && digits < 9) put('.');
  while (rest && digits < 9) {
    rest *= 10;
    const char digit = (char)(rest >> places);
    rest -= (uint64_t)digit << places;
    put('0' + digit);
    if (digit || digits) digits++;
  }
  if (tens) {
    put('e');
    putWhole(tens);
  }
}

void begin(const char *text) {
  sum = 0xFFFF;
  put(text);
}

void end(bool hasChecksum) {
  const uint16_t whole = sum;
  if (hasChecksum) {
    Serial.write('*');
    for (int shift = 12; shift >= 0; shift -= 4) Serial.write("0123456789ABCDEF"[whole >> shift & 15]);
  }
  Serial.write('\n');
}

void ok(uint32_t n) {
  begin("{\"ok\":");
  putUnsigned(n);
  put('}');
  end(true);
}

void no(bool hasNumber, uint32_t n, const char *why) {
  begin("{\"no\":");
  if (hasNumber) putUnsigned(n);
  else put("null");
  put(",\"why\":\"");
  put(why);
  put("\"}");
  end(hasGreeted);
}

void describe(uint32_t n) {
  begin("{\"ok\":");
  putUnsigned(n);
  put(",\"sidecar\":1,\"name\":\"");
  put(NAME);
  put("\",\"boot\":");
  putUnsigned(boot);
  put(",\"tick_ns\":1000,\"rate\":");
  putWhole(RATE);
  put(",\"silence_ms\":");
  putWhole(SILENCE_MS);
  put(",\"crc\":true,\"axis\":{\"mm_per_pulse\":");
  putReal(MM_PER_PULSE);
  put(",\"travel_mm\":");
  putReal(TRAVEL_MM);
  put(",\"speed_max\":");
  putReal(SPEED_MAX);
  put(",\"acceleration\":");
  putReal(ACCELERATION);
  put(",\"lag_ms\":5},\"cell\":{\"counts_min\":-8388608,\"counts_max\":8388607,\"volts_per_count\":5.9604645e-7,"
      "\"noise_v\":3e-4},\"sensors\":[{\"name\":\"temperature\",\"unit\":\"\\u00b0C\"}]}");
  end(false);
}

// What stands behind "key": in the line, or 0.
const char *find(const char *key) {
  const unsigned size = strlen(key);
  for (const char *at = line; *at; at++) {
    if (*at == '"' && strncmp(at + 1, key, size) == 0 && at[size + 1] == '"' && at[size + 2] == ':') return at + size + 3;
  }
  return 0;
}

// A number of the line; false where there is none.
bool number(const char *key, double *value) {
  const char *at = find(key);
  char *stop = 0;
  if (!at || !(*at == '-' || (*at >= '0' && *at <= '9'))) return false;
  *value = strtod(at, &stop);
  return stop != at && (*stop == ',' || *stop == '}');
}

bool isWord(const char *word) {
  const char *at = find("do");
  const unsigned size = strlen(word);
  return at && *at == '"' && strncmp(at + 1, word, size) == 0 && at[size + 1] == '"';
}

// Takes the checksum off the line. False where it is wrong.
bool checkLine() {
  if (length < 7 || line[0] != '{') return false;
  if (isWord("hello")) return line[length - 1] == '}';
  const char *star = line + length - 5;
  if (*star != '*' || star[-1] != '}') return false;
  sum = 0xFFFF;
  for (const char *at = line; at < star; at++) {
    sum ^= (uint16_t)(uint8_t)*at << 8;
    for (int i = 0; i < 8; i++) sum = sum & 0x8000 ? (uint16_t)(sum << 1) ^ 0x1021 : (uint16_t)(sum << 1);
  }
  const bool isRight = strtoul(star + 1, 0, 16) == sum;
  line[length - 5] = 0;
  return isRight;
}

void onMove(uint32_t n) {
  double to, speed, a;
  if (!number("to", &to) || !number("speed", &speed) || !number("acceleration", &a)) return no(true, n, "a key is missing");
  if (!isMotorOn) return no(true, n, "the motor is off");
  if (isMoving) return no(true, n, "the axis is moving");
  if (!(speed > 0 && speed <= SPEED_MAX * 1.000001) || !(a > 0 && a <= ACCELERATION * 1.000001)) {
    return no(true, n, "speed or acceleration is out of range");
  }
  ok(n);
  beginMove(to * MM_PER_PULSE, speed, a);
}

void onLine() {
  double value;
  if (!checkLine() || !number("n", &value) || value < 0 || !find("do")) return no(false, 0, "not understood");
  const uint32_t n = (uint32_t)value;
  if (isWord("hello")) {
    brake();
    isSending = false;
    hasGreeted = true;
    heardMs = millis();
    return describe(n);
  }
  if (!hasGreeted) return no(true, n, "hello first");
  heardMs = millis();
  if (isWord("beat")) {
    begin("{\"ok\":");
    putUnsigned(n);
    put(",\"t\":");
    putUnsigned(micros());
    put('}');
    return end(true);
  }
  if (isWord("move")) return onMove(n);
  if (isWord("stop")) brake();
  else if (isWord("halt")) cut();
  else if (isWord("enable")) enableMotor();
  else if (isWord("start")) isSending = true;
  else if (isWord("bye")) {
    brake();
    isSending = false;
    return;
  } else return no(true, n, "not known");
  ok(n);
}

void sendSample() {
  static int count = 0;
  float velocity;
  const uint32_t at = micros();
  const float mm = positionMm(&velocity);
  const int status = (isMoving ? MOVING : 0) | (isMoving && isStopping ? STOPPING : 0) | (isHome() ? HOME : 0) | (isMotorOn ? MOTOR_ON : 0);
  begin("{\"t\":");
  putUnsigned(at);
  put(",\"c\":");
  putWhole(readCounts());
  put(",\"p\":");
  putWhole(lround(mm / MM_PER_PULSE));
  put(",\"s\":");
  putWhole(status);
  if (++count % RATE == 0) {
    put(",\"v\":[");
    putReal(readTemperature());
    put(']');
  }
  put('}');
  end(true);
}

void readLines() {
  while (Serial.available() > 0) {
    const char c = Serial.read();
    if (c == '\n') {
      line[length] = 0;
      if (isTooLong) no(false, 0, "the line is too long");
      else if (length > 0) onLine();
      length = 0;
      isTooLong = false;
    } else if (c != '\r') {
      if (length + 1 < sizeof line) line[length++] = c;
      else isTooLong = true;
    }
  }
}

void setup() {
  Serial.begin(BAUD);
  randomSeed(analogRead(0) ^ micros());
  boot = random(1, 2147483647L);    // an ESP32 has esp_random()
  begin("{\"boot\":");
  putUnsigned(boot);
  put('}');
  end(false);
  dueUs = micros();
}

void loop() {
  readLines();
  if ((uint32_t)(millis() - heardMs) >= SILENCE_MS) brake();
  if (isMoving && elapsed() >= seconds) isMoving = false;
  if ((int32_t)(micros() - dueUs) >= 0) {
    dueUs += 1000000UL / RATE;
    if ((int32_t)(micros() - dueUs) > 5000000L / RATE) dueUs = micros();    // it stood still
    if (isSending) sendSample();
  }
}
