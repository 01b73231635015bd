"""A program that is a sidecar ends well when only the reading end of its output is closed in the middle of a motion.

Usage: closed_output.py WORD..., which start the program. It must brake, go on until its axis stands, and end with exit code 0.
"""
import json
import os
import subprocess
import sys
import time

SPEED, ACCELERATION = 1.0, 5.0
BRAKING = SPEED / ACCELERATION
LATE = 0.05  # s without a beat: a quarter of the silence after which the axis brakes by itself


def attempt(words):
    """The exit code and the time from the end of the output to the end of the program; None if this computer was too late."""
    program = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    os.set_blocking(program.stdout.fileno(), False)
    number, rest, begun, written = 0, b"", None, 0.0

    def say(word, **keys):
        nonlocal number, written
        number += 1
        written = time.monotonic()
        program.stdin.write(json.dumps({"n": number, "do": word, **keys}).encode() + b"\n")
        program.stdin.flush()

    say("hello", version=1)
    end = time.monotonic() + 300
    while True:
        assert time.monotonic() < end, "it never moves at full speed"
        data = program.stdout.read(4096)
        assert data != b"", "the program has ended"
        *lines, rest = (rest + (data or b"")).split(b"\n")
        for line in map(json.loads, lines):
            if "sidecar" in line:
                say("start", binary=False)
                say("enable")
                say("move", to=8000, speed=SPEED, acceleration=ACCELERATION)
            elif "s" in line and line["s"] & 1 and begun is None:
                begun = time.monotonic()
            elif "s" in line and begun is not None and line["s"] & 3 != 1:
                begun = None  # it has braked for want of beats
                say("move", to=8000, speed=SPEED, acceleration=ACCELERATION)
        now = time.monotonic()
        if begun is not None and now - begun > 2 * BRAKING and now - written < LATE:
            break
        if now - written > 0.02:
            say("beat")
        time.sleep(0.002)
    program.stdout.close()
    closed = time.monotonic()
    is_late = closed - written > LATE
    code = program.wait(60)
    program.stdin.close()
    return None if is_late else (code, time.monotonic() - closed)


for _ in range(20):
    result = attempt(sys.argv[1:])
    if result is not None:
        break
else:
    sys.exit("this computer is too busy")
code, time_s = result
assert code == 0, f"exit code {code}"
# A clock of the program that is a little fast does no harm.
assert time_s > 0.95 * BRAKING, f"it ended {time_s:.3f} s after its output, but braking takes {BRAKING} s"
print(f"exit code 0 after {time_s:.3f} s of {BRAKING} s of braking")
