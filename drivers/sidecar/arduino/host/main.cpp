// Runs a sketch on this computer, as an emulated ESP32 behind a pseudo-terminal: sketch LINK, which becomes a link to the port.
//
// Its counters have 32 bits as on the board, and its clock is 40 ppm fast. SIGUSR1 resets the board. Ends with its standard input.
//
// SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
#include "Arduino.h"

#include <cerrno>
#include <csignal>
#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <ctime>
#include <unistd.h>

static int port = -1;
static char input[4096], output[65536];
static int inputFrom = 0, inputTo = 0, outputTo = 0;
static volatile sig_atomic_t isReset = 0;
Port Serial;

static uint64_t nanos() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static const uint64_t start = nanos();

unsigned long micros() { return (uint32_t)((double)(nanos() - start) * 1.00004e-3); }
unsigned long millis() { return (uint32_t)((double)(nanos() - start) * 1.00004e-6); }
int Port::available() { return inputTo - inputFrom; }
int Port::read() { return (unsigned char)input[inputFrom++]; }

// What no program reads is lost, as on a serial line.
void Port::write(char c) {
  if (outputTo < (int)sizeof output) output[outputTo++] = c;
}

#include SKETCH

static void onReset(int) { isReset = 1; }

int main(int count, char **words) {
  if (count != 2) return fprintf(stderr, "usage: sketch LINK\n"), 2;
  port = posix_openpt(O_RDWR | O_NOCTTY);
  if (port < 0 || grantpt(port) || unlockpt(port)) return perror("pseudo-terminal"), 1;
  const char *name = ptsname(port);
  // The other end is kept open, so that a program may come and go.
  const int other = open(name, O_RDWR | O_NOCTTY);
  termios raw;
  tcgetattr(other, &raw);
  cfmakeraw(&raw);
  tcsetattr(other, TCSANOW, &raw);
  fcntl(port, F_SETFL, O_NONBLOCK);
  unlink(words[1]);
  if (symlink(name, words[1])) return perror(words[1]), 1;
  std::signal(SIGUSR1, onReset);
  fprintf(stderr, "emulated board at %s\n", words[1]);
  std::srand((unsigned)nanos());
  setup();
  for (;;) {
    if (isReset) {
      // The counters of a real board begin again; these do not, but boot and motion do.
      isReset = 0;
      hasGreeted = isSending = isMotorOn = isMoving = false;
      setup();
    }
    pollfd watched[] = {{port, POLLIN, 0}, {0, POLLIN, 0}};
    poll(watched, 2, inputTo == inputFrom ? 1 : 0);
    char rest[16];
    if (watched[1].revents && read(0, rest, sizeof rest) <= 0) break;
    if (inputFrom == inputTo) {
      inputFrom = inputTo = 0;
      const ssize_t got = read(port, input, sizeof input);
      if (got > 0) inputTo = (int)got;
    }
    loop();
    if (outputTo > 0) {
      const ssize_t sent = write(port, output, (size_t)outputTo);
      if (sent > 0) {
        memmove(output, output + sent, (size_t)(outputTo - sent));
        outputTo -= (int)sent;
      } else if (errno == EAGAIN) {
        outputTo = 0;
      }
    }
  }
  unlink(words[1]);
  return 0;
}
