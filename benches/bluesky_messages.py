#!/usr/bin/env python3
"""What a message costs Bluesky's RunEngine, beside what a sample costs our engine, in one run.

Usage: benches/bluesky_messages.py [MESSAGES]     (100000 without; needs `pip install bluesky`)
"""
import json
import pathlib
import subprocess
import sys
import time

from bluesky import Msg, RunEngine
import bluesky

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    engine = RunEngine({})

    def plan():
        for _ in range(count):
            yield Msg("null")

    engine(plan())  # Warm.
    start = time.perf_counter()
    engine(plan())
    theirs = (time.perf_counter() - start) / count * 1e9
    command = ["cargo", "run", "--quiet", "-p", "palpate-protocols", "--example", "engine_overhead", "--", "1"]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE)
    ours = json.loads(done.stdout)["ns_per_sample_worst_hour"]
    print(f"bluesky {bluesky.__version__}: {theirs:.0f} ns a message ({count} messages 'null'); "
          f"palpate: {ours:.0f} ns a sample; ratio {theirs / ours:.0f}")


if __name__ == "__main__":
    main()
