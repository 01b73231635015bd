// Two Arduinos at the pace of the wall clock, each executing its own firmware: one steps a slide, one reads a load cell.
// Both are Pro Minis at 8 MHz, for that is what an emulator keeps up with beside other programs.
//
// SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate. Linked with simavr, which is under the GPL 3, and never
// distributed; scripts/grbl-firmware compiles and runs it.
//
// Usage: boards AXIS.elf CELL.elf AXIS CELL LOG MM_PER_STEP TRAVEL_MM START_MM CONTACT_MM
// AXIS and CELL become links to pseudo-terminals, the serial ports of the two. LOG takes a line for every byte that the axis
// got, every millisecond in which it stepped, and whatever was lost or late: kind, ns of CLOCK_MONOTONIC, value. LOG.cell is
// that of the cell, which has a process of its own.
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define CLOCK_HZ 8000000
// So much of a board's time between looks at its serial input: a byte takes 87 us.
#define SLICE_NS 20000
// A millisecond of the slide, the tissue and the chip.
#define TICK_NS 1000000
// More than this is not caught up: a board stood still, as the computer did. What it has to do with did not.
#define CATCH_UP_NS 50000000ULL
// OCR1A of an ATmega328P. simavr takes a timer that counts to zero for one that is off; the chip takes it for the fastest,
// and so begins the first motion of Grbl. Grbl sets it again before the first step.
#define OCR1AL 0x88

// Pins of Grbl on an ATmega328P (gnea/grbl, cpu_map.h): step and direction of X on D, its limit switch on B, the probe on C.
#define STEP_PIN 2
#define DIRECTION_PIN 5
#define LIMIT_PIN 1
#define PROBE_PIN 5
// Pins of palpate's sketch, both on D.
#define SCK_PIN 2
#define DOUT_PIN 3

// Tissue: F + TAU F' = MU1 x + MU2 x^2 + MU3 x^3 + SIGMA x x', the body of the thesis (equation 3.5); N, mm and s.
#define TAU 1.023
#define MU1 0.05333
#define MU2 -0.0086
#define MU3 0.0004345
#define SIGMA 0.06
// Load cell as the HX711 sees it: V = 1.28 + 0.4 F of 5 V in 23 bits, with noise.
#define VOLTS_AT_REST 1.28
#define VOLTS_PER_N 0.4
#define NOISE_V 0.0002
#define COUNTS_PER_V ((1 << 23) / 5.0)
// Ticks of a conversion at 80 a second; the chip settles over four (data sheet, page 3).
#define CONVERSION_MS 12.5
#define SETTLING_MS 50

struct board {
  avr_t *avr;
  int port;
  avr_irq_t *input;
  int has_room;
  uint8_t held[4], high[4];
  uint8_t queue[4096];
  unsigned first, last;
  double clock_error;
  uint64_t begun;
};

static struct board axis = {.has_room = 1, .clock_error = 1.001};
static struct board cell = {.has_room = 1, .clock_error = 0.998};
static double mm_per_step, travel_mm, start_mm, contact_mm;
static int64_t steps;
static int direction = 1;
// N, from the process of the axis to that of the cell.
static volatile double *force;
static struct {
  uint32_t shifting;
  int clocks;
} chip = {.clocks = 25};
static FILE *record;
static volatile sig_atomic_t is_over;

static uint64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (uint64_t)t.tv_sec * 1000000000ULL + (uint64_t)t.tv_nsec;
}

static void note(const char *kind, uint64_t at, int64_t value) {
  fprintf(record, "%s %llu %lld\n", kind, (unsigned long long)at, (long long)value);
}

static double place(void) { return start_mm + (double)steps * mm_per_step; }

static void on_step(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  steps += value ? direction : 0;
}

static void on_direction(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  direction = value ? -1 : 1;
}

static avr_irq_t *pin(struct board *board, char port, int number) {
  return avr_io_getirq(board->avr, AVR_IOCTL_IOPORT_GETIRQ(port), number);
}

// Holds an input pin at a level against its pull-up, which simavr would else put there at every write to the port.
static void drive(struct board *board, char port, int number, int level) {
  uint8_t *held = &board->held[port - 'A'], *high = &board->high[port - 'A'];
  *held |= 1 << number;
  *high = (uint8_t)((*high & ~(1 << number)) | level << number);
  avr_ioport_external_t external = {.name = (unsigned char)port, .mask = *held, .value = *high};
  avr_ioctl(board->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &external);
  avr_raise_irq(pin(board, port, number), (uint32_t)level);
}

// A rising clock shifts the next bit out; the 25th ends the reading and chooses channel and gain (data sheet, page 4).
static void on_sck(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)param;
  if (!value || chip.clocks > 24) {
    return;
  }
  chip.clocks++;
  drive(&cell, 'D', DOUT_PIN, chip.clocks > 24 || (chip.shifting >> (24 - chip.clocks) & 1));
}

static void on_output(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  const uint8_t byte = (uint8_t)value;
  // A full pseudo-terminal loses bytes, as a wire does without a listener.
  if (write(((struct board *)param)->port, &byte, 1) != 1) {
    note("lost", now_ns(), byte);
  }
}

static void on_room(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value;
  ((struct board *)param)->has_room = 1;
}

static void on_full(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq, (void)value;
  ((struct board *)param)->has_room = 0;
}

static void on_signal(int number) {
  (void)number;
  is_over = 1;
}

static int terminal(const char *link_name) {
  const int port = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (port < 0 || grantpt(port) || unlockpt(port)) {
    perror("posix_openpt");
    exit(1);
  }
  const char *name = ptsname(port);
  // The other side stays open, so that readers may come and go.
  const int other = open(name, O_RDWR | O_NOCTTY);
  struct termios how;
  tcgetattr(other, &how);
  cfmakeraw(&how);
  tcsetattr(other, TCSANOW, &how);
  unlink(link_name);
  if (symlink(name, link_name)) {
    perror(link_name);
    exit(1);
  }
  return port;
}

static void start(struct board *board, const char *file, const char *link_name) {
  elf_firmware_t firmware;
  memset(&firmware, 0, sizeof firmware);
  if (elf_read_firmware(file, &firmware)) {
    fprintf(stderr, "cannot read %s\n", file);
    exit(1);
  }
  firmware.frequency = CLOCK_HZ;
  board->avr = avr_make_mcu_by_name("atmega328p");
  avr_init(board->avr);
  avr_load_firmware(board->avr, &firmware);
  board->avr->log = LOG_ERROR;
  board->port = terminal(link_name);
  uint32_t flags = 0;
  avr_ioctl(board->avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
  flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
  avr_ioctl(board->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_irq_t *uart = avr_io_getirq(board->avr, AVR_IOCTL_UART_GETIRQ('0'), 0);
  board->input = uart + UART_IRQ_INPUT;
  avr_irq_register_notify(uart + UART_IRQ_OUTPUT, on_output, board);
  avr_irq_register_notify(uart + UART_IRQ_OUT_XON, on_room, board);
  avr_irq_register_notify(uart + UART_IRQ_OUT_XOFF, on_full, board);
}

static void hear(struct board *board) {
  uint8_t bytes[256];
  const ssize_t got = read(board->port, bytes, sizeof bytes);
  for (ssize_t i = 0; i < got && board->last - board->first < sizeof board->queue; i++) {
    board->queue[board->last++ % sizeof board->queue] = bytes[i];
    note("byte", now_ns(), bytes[i]);
  }
}

static double normal(void) {
  const double a = (rand() + 1.0) / (RAND_MAX + 2.0), b = (rand() + 1.0) / (RAND_MAX + 2.0);
  return sqrt(-2 * log(a)) * cos(2 * M_PI * b);
}

// A millisecond of slide and tissue.
static void axis_tick(void) {
  static int reported = -1;
  static int64_t reported_steps;
  if (!axis.avr->data[OCR1AL] && !axis.avr->data[OCR1AL + 1]) {
    const int number = AVR_DATA_TO_IO(OCR1AL);
    axis.avr->io[number].w.c(axis.avr, OCR1AL, 100, axis.avr->io[number].w.param);
  }
  const int is_home = place() <= 0, is_end = place() <= -2 || place() >= travel_mm + 2;
  if (reported != (is_home | is_end << 1)) {
    reported = is_home | is_end << 1;
    drive(&axis, 'C', PROBE_PIN, !is_home);
    drive(&axis, 'B', LIMIT_PIN, !is_end);
  }
  if (steps != reported_steps) {
    reported_steps = steps;
    // When the others see them, which is later than when they were due if the computer is.
    note("steps", now_ns(), steps);
  }
  static double before, pull;
  const double x = fmax(place() - contact_mm, 0);
  const double driven = x * (MU1 + x * (MU2 + x * MU3)) + SIGMA * x * (x - before) / 1e-3;
  pull += (driven - pull) * (1 - exp(-1e-3 / TAU));
  before = x;
  *force = x > 0 ? fmax(pull, 0) : 0;
}

// A millisecond of the chip.
static void cell_tick(void) {
  static double felt[SETTLING_MS];
  static uint64_t ticks, conversions;
  felt[ticks++ % SETTLING_MS] = *force;
  if ((uint64_t)((double)ticks / CONVERSION_MS) == conversions) {
    return;
  }
  conversions++;
  double mean = 0;
  for (int i = 0; i < SETTLING_MS; i++) {
    mean += felt[i] / SETTLING_MS;
  }
  // No host reads so slowly that a conversion would come into it.
  const double count = (VOLTS_AT_REST + VOLTS_PER_N * mean + NOISE_V * normal()) * COUNTS_PER_V;
  chip.shifting = (uint32_t)lround(fmin(count, (1 << 23) - 1)) & 0xFFFFFF;
  chip.clocks = 0;
  drive(&cell, 'D', DOUT_PIN, 0);
}

// Nanoseconds since its start, by its own cycles and the wall's clock.
static uint64_t done(const struct board *board) {
  return (uint64_t)((double)board->avr->cycle / CLOCK_HZ / board->clock_error * 1e9);
}

static void slice(struct board *board) {
  if (board->has_room && board->first != board->last) {
    avr_raise_irq(board->input, board->queue[board->first++ % sizeof board->queue]);
  }
  const uint64_t until = board->avr->cycle + CLOCK_HZ / 1000 * SLICE_NS / 1000000;
  while (board->avr->cycle < until) {
    const int state = avr_run(board->avr);
    if (state == cpu_Crashed || state == cpu_Done) {
      fprintf(stderr, "a firmware has crashed\n");
      exit(1);
    }
  }
}

static void run(struct board *board, void (*tick)(void)) {
  board->begun = now_ns();
  uint64_t next_tick = TICK_NS;
  while (!is_over) {
    hear(board);
    const uint64_t at = now_ns();
    const uint64_t due = at - board->begun;
    if (due > done(board) + CATCH_UP_NS) {
      const uint64_t behind = due - done(board);
      note("late", at, (int64_t)(behind / 1000000));
      board->begun += behind;
      for (uint64_t passed = 0; passed < behind; passed += TICK_NS) {
        tick();
      }
      continue;
    }
    while (done(board) < due) {
      slice(board);
      if (done(board) >= next_tick) {
        next_tick += TICK_NS;
        tick();
      }
    }
    fflush(record);
    struct pollfd wait = {.fd = board->port, .events = POLLIN};
    poll(&wait, 1, 1);
  }
  fclose(record);
}

int main(int count, char **words) {
  if (count != 10) {
    fprintf(stderr, "usage: boards AXIS.elf CELL.elf AXIS CELL LOG MM_PER_STEP TRAVEL_MM START_MM CONTACT_MM\n");
    return 2;
  }
  mm_per_step = atof(words[6]), travel_mm = atof(words[7]), start_mm = atof(words[8]), contact_mm = atof(words[9]);
  signal(SIGTERM, on_signal);
  signal(SIGINT, on_signal);
  start(&axis, words[1], words[3]);
  start(&cell, words[2], words[4]);
  avr_irq_register_notify(pin(&axis, 'D', STEP_PIN), on_step, NULL);
  avr_irq_register_notify(pin(&axis, 'D', DIRECTION_PIN), on_direction, NULL);
  avr_irq_register_notify(pin(&cell, 'D', SCK_PIN), on_sck, NULL);
  drive(&cell, 'D', DOUT_PIN, 1);
  // Every switch is open and pulled up.
  for (int number = 0; number < 6; number++) {
    drive(&axis, 'B', number, 1);
    drive(&axis, 'C', number, 1);
  }
  force = mmap(NULL, sizeof *force, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  char name[4096];
  const int child = fork();
  snprintf(name, sizeof name, "%s%s", words[5], child ? "" : ".cell");
  record = fopen(name, "w");
  if (force == MAP_FAILED || child < 0 || !record) {
    perror(name);
    return 1;
  }
  if (!child) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    run(&cell, cell_tick);
    return 0;
  }
  puts("ready");
  fflush(stdout);
  run(&axis, axis_tick);
  kill(child, SIGTERM);
  waitpid(child, NULL, 0);
  unlink(words[3]);
  unlink(words[4]);
  return 0;
}
