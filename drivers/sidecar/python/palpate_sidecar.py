"""A rig, a load cell or sensors for palpate as a Python program: the sidecar protocol, version 1.

Python 3.9 or later, standard library alone. Derive a class from Sidecar, describe it by class attributes, and write
`sample` and, for an axis, `move`, `stop` and `halt`. `run` does the rest: it talks on standard input and output, or
listens with `--tcp HOST:PORT`; it answers, keeps the watchdog, sends samples in time, and stops the axis when the link
ends or your code fails. The protocol is in palpate's documents, "The sidecar protocol".

SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
"""
import argparse
import contextlib
import json
import math
import os
import random
import select
import socket
import struct
import sys
import time

MOVING, STOPPING, HOME, FORWARD_LIMIT, REVERSE_LIMIT, MOTOR_ON = 1, 2, 4, 8, 16, 32
LINE_MAX = 200  # characters of palpate's lines
TCP_SILENCE = 2.0  # seconds; a peer that vanished is not waited for longer, so that a new one is served
UNSENT_MAX = 65536  # bytes that wait for palpate; samples beyond are dropped, so that the watchdog never waits


class Refused(Exception):
    """Raise it in move, sine or enable to refuse a command, with the reason as its text."""


class _LinkEnd(Exception):
    """Nothing can be written any more."""


def crc16(data):
    """CRC-16/CCITT-FALSE of bytes."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


class Trapezoid:
    """A position in mm that follows moves with a trapezoid of speed, for drives that take positions from outside."""

    def __init__(self, position=0.0):
        self.start, self.end, self.begun, self.stopping = position, position, 0.0, False
        self.speed, self.acceleration, self.entry = 0.0, 1.0, 0.0

    def move(self, end, speed, acceleration):
        self.start, self.end, self.begun, self.stopping = self.now(), end, time.monotonic(), False
        way = abs(end - self.start)
        self.acceleration, self.entry = acceleration, 0.0
        self.speed = min(speed, math.sqrt(way * acceleration))  # a short way has no cruise

    def stop(self):
        """Brake with the acceleration of the motion."""
        if self.moving() and not self.stopping:
            position, velocity = self.state()
            self.entry = abs(velocity)
            self.start, self.begun, self.stopping = position, time.monotonic(), True
            self.end = position + math.copysign(self.entry**2 / (2 * self.acceleration), velocity)

    def halt(self):
        self.start = self.end = self.now()
        self.stopping = True

    def moving(self):
        return time.monotonic() - self.begun < self.duration()

    def now(self):
        return self.state()[0]

    def duration(self):
        way = abs(self.end - self.start)
        if way == 0.0:
            return 0.0
        if self.stopping:
            return self.entry / self.acceleration
        return way / self.speed + self.speed / self.acceleration

    def state(self):
        """Position in mm and velocity in mm/s now."""
        t, total, a, v = time.monotonic() - self.begun, self.duration(), self.acceleration, self.speed
        if t >= total:
            return self.end, 0.0
        sign = math.copysign(1.0, self.end - self.start)
        if self.stopping:
            return self.start + sign * (self.entry * t - a * t * t / 2), sign * (self.entry - a * t)
        ramp = v / a
        if t < ramp:
            return self.start + sign * a * t * t / 2, sign * a * t
        if t > total - ramp:
            return self.end - sign * a * (total - t) ** 2 / 2, sign * a * (total - t)
        return self.start + sign * (v * ramp / 2 + v * (t - ramp)), sign * v


class Sidecar:
    name, serial = "sidecar", None
    rate = 100  # samples a second
    silence_ms = 200  # the axis stops by itself after so long without a line
    crc = False  # True on a serial line
    binary = True
    axis = None  # {"mm_per_pulse": 0.01, "travel_mm": 50, "speed_max": 5, "acceleration": 20, "lag_ms": 0}
    cell = None  # {"counts_min": -8388608, "counts_max": 8388607, "volts_per_count": 6e-7, "noise_v": 3e-4}
    sensors = ()  # [{"name": "temperature", "unit": "°C"}]

    def enable(self):
        """Energise the motor and hold the position."""

    def move(self, to, speed, acceleration):
        """Begin a motion to a position in pulses, in mm/s and mm/s². Must return at once."""
        raise Refused("there is no axis")

    def sine(self, amplitude, period, cycles, acceleration):
        raise Refused("there are no sines")

    def stop(self):
        """Brake. Must return at once."""

    def halt(self):
        self.stop()

    def moving(self):
        """Whether the axis moves."""
        return False

    def sample(self):
        """The keys of a sample: "c" counts, "p" pulses, "s" status, "v" list of sensor values or None. Must be quick."""
        raise NotImplementedError

    def ticks(self):
        return time.monotonic_ns() // 1000 & 0xFFFFFFFF

    # What follows is the protocol.

    def run(self, arguments=None):
        parser = argparse.ArgumentParser(description=f"palpate sidecar {self.name}")
        parser.add_argument("--tcp", metavar="HOST:PORT", help="listen here instead of on standard input")
        tcp = parser.parse_args(arguments).tcp
        self.boot = random.randrange(1, 1 << 31)
        if tcp is None:
            output = os.dup(1)
            os.dup2(2, 1)  # what your code prints goes to the log
            return self._serve(0, output)
        host, port = tcp.rsplit(":", 1)
        with socket.create_server((host, int(port))) as server:
            print(f"{self.name} listens at {server.getsockname()[0]}:{server.getsockname()[1]}", file=sys.stderr)
            while True:
                client, _ = server.accept()
                with client:
                    with contextlib.suppress(OSError):
                        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._serve(client.fileno(), client.fileno(), TCP_SILENCE)

    def _serve(self, source, sink, patience=math.inf):
        """Talks until the link ends or is silent for too long; whatever happens, the axis is stopped."""
        os.set_blocking(source, False)
        os.set_blocking(sink, False)
        self._sink, self._unsent, self._line = sink, b"", b""
        self._greeted, self._sending, self._frames, self._silent = False, False, False, True
        period, self._heard, due = 1.0 / self.rate, time.monotonic(), time.monotonic()
        try:
            self._say({"boot": self.boot})
            while True:
                wait = min(0.02, max(0.0, due - time.monotonic()))  # the watchdog is looked at in any case
                readable, writable, _ = select.select([source], [sink] if self._unsent else [], [], wait)
                is_over = not self._read(source) if readable else time.monotonic() - self._heard > patience
                if is_over:
                    return
                if writable:
                    self._flush()
                now = time.monotonic()
                if now - self._heard >= self.silence_ms / 1000 and not self._silent:
                    self._silent = True
                    self.stop()
                if now >= due:
                    due = max(due + period, now - 5 * period)
                    if self._sending:
                        self._send_sample()
        except _LinkEnd:
            return
        except Exception as error:
            with contextlib.suppress(_LinkEnd):
                self._say({"fault": f"{type(error).__name__}: {error}"[:120]})
            raise
        finally:
            self.stop()
            with contextlib.suppress(Exception):
                self._rest()

    def _rest(self):
        """Sends samples until the axis stands, for most of the time that palpate leaves a program to end."""
        until = time.monotonic() + 0.4
        while self.moving() and time.monotonic() < until:
            time.sleep(min(0.05, 1.0 / self.rate))
            with contextlib.suppress(Exception):  # the link may be gone, and the axis still brakes
                if self._sending:
                    self._send_sample()

    def _read(self, source):
        try:
            data = os.read(source, 4096)
        except OSError as error:
            return isinstance(error, BlockingIOError)
        *lines, self._line = (self._line + data).split(b"\n")
        for line in filter(None, (line.strip(b"\r") for line in lines)):
            self._take(line)
        self._line = self._line[: LINE_MAX + 100]  # a line without an end is cut, and garbled
        return bool(data)

    def _take(self, line):
        try:
            if len(line) > LINE_MAX + 5:
                raise ValueError("the line is too long")
            if self.crc and b'"do":"hello"' not in line:
                line, _, checksum = line.rpartition(b"*")
                if checksum.upper() != b"%04X" % crc16(line):
                    raise ValueError("the checksum is wrong")
            message = json.loads(line.decode("ascii"))
            number, word = message["n"], message["do"]
            if type(number) is not int or number < 0 or type(word) is not str:
                raise ValueError("n is a number, and do is a word")
        except (ValueError, KeyError, TypeError) as error:
            return self._say({"no": None, "why": str(error)[:80]})
        try:
            answer = self._obey(word, message)
        except (Refused, KeyError, TypeError, ValueError) as error:
            return self._say({"no": number, "why": str(error)[:80]})
        self._heard, self._silent = time.monotonic(), False
        if answer is not None:
            self._say({"ok": number, **answer}, plain=word == "hello")

    def _obey(self, word, message):
        if word == "hello":
            if message["version"] != 1:
                raise Refused("only version 1 is spoken")
            self.stop()
            self._greeted, self._sending = True, False
            return self._description()
        if not self._greeted:
            raise Refused("hello first")
        if word == "start":
            self._sending, self._frames = True, self.binary and message.get("binary", False)
        elif word == "beat":
            return {"t": self.ticks()}
        elif word in ("enable", "stop", "halt"):
            getattr(self, word)()
        elif word == "move":
            to, speed, acceleration = int(message["to"]), float(message["speed"]), float(message["acceleration"])
            axis = self.axis or {}
            if self.moving():
                raise Refused("the axis is moving")
            if not 0 < speed <= axis.get("speed_max", 0) * 1.000001 or not acceleration > 0:
                raise Refused("speed or acceleration is out of range")
            self.move(to, speed, acceleration)
        elif word == "sine":
            self.sine(message["amplitude"], message["period"], message["cycles"], message["acceleration"])
        elif word == "bye":
            self.stop()
            self._sending = False
            return None
        else:
            raise Refused(f"{word} is not known")
        return {}

    def _description(self):
        about = {"sidecar": 1, "name": self.name, "serial": self.serial, "boot": self.boot, "tick_ns": 1000}
        about.update(rate=self.rate, silence_ms=self.silence_ms, crc=self.crc, binary=self.binary)
        about.update(axis=self.axis, cell=self.cell, sensors=list(self.sensors))
        return {key: value for key, value in about.items() if value is not None}

    def _send_sample(self):
        sample = {"t": self.ticks(), **self.sample()}
        if self._frames and "v" not in sample:
            frame = struct.pack("<BIiiB", 13, sample["t"], sample.get("c", 0), sample.get("p", 0), sample.get("s", 0))
            self._send(b"\xa5" + frame + struct.pack("<H", crc16(frame)))
        else:
            self._say(sample)

    def _say(self, message, plain=False):
        text = json.dumps(message, separators=(",", ":"), allow_nan=False).encode("ascii")
        has_checksum = self.crc and self._greeted and not plain
        self._send(text + (b"*%04X\n" % crc16(text) if has_checksum else b"\n"))

    def _send(self, data):
        if len(self._unsent) + len(data) <= UNSENT_MAX:
            self._unsent += data
        self._flush()

    def _flush(self):
        try:
            self._unsent = self._unsent[os.write(self._sink, self._unsent) :]
        except OSError as error:
            if not isinstance(error, BlockingIOError):
                raise _LinkEnd from error
