"""Fits the sessions of a lake on the computers of a Ray cluster: every shard is a task that runs `palpate fit LAKE --shard i/n`.

    pip install 'palpate[ray]'
    python -m palpate.ray lake --shards 16 -- --fixed f_offset=0

A task whose worker or whose palpate is killed begins again, and goes on where it was, for fits that are in the lake are
passed over. A session that cannot be fitted is no reason to begin again: the shard is named, and the exit code is 1.
"""
from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from typing import Any, Dict, List, Optional, Tuple

try:
    import ray
except ImportError:
    ray = None


class Killed(Exception):
    """palpate was ended by a signal: by the system, for want of memory, or by a person."""


def fit_shard(command: List[str]) -> Tuple[int, Dict[str, Any], str]:
    """Runs one shard. Its exit code, its report, and what it said on standard error."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode < 0:
        raise Killed(f"palpate was ended by signal {-done.returncode}")
    report = json.loads(done.stdout.splitlines()[0]) if done.stdout else {}
    return done.returncode, report, done.stderr.strip()


def arguments(words: Optional[List[str]]) -> argparse.Namespace:
    usage = "python -m palpate.ray LAKE --shards N [--palpate PATH] [--address A | --workers N] [--cpus N] [--retries N] [-- FIT OPTIONS]"
    parser = argparse.ArgumentParser(usage=usage, description=__doc__)
    parser.add_argument("lake", metavar="LAKE", help="folder of a lake, on a file system that all computers share")
    parser.add_argument("--shards", metavar="N", type=int, required=True, help="parts; four for each worker keep all busy to the end")
    parser.add_argument("--palpate", metavar="PATH", help="another program than this package's, the same on all computers")
    parser.add_argument("--address", help="of a Ray cluster; without it one is begun on this computer")
    parser.add_argument("--workers", metavar="N", type=int, help="tasks at a time on this computer, where no address is given")
    parser.add_argument("--cpus", metavar="N", type=int, default=1, help="processors of one task, and its --jobs")
    parser.add_argument("--retries", metavar="N", type=int, default=5, help="how often a task that was killed begins again")
    words = sys.argv[1:] if words is None else words
    here = words.index("--") if "--" in words else len(words)
    args = parser.parse_args(words[:here])
    args.fit = words[here + 1:]
    if args.shards < 1 or args.cpus < 1 or args.retries < 0 or (args.workers or 1) < 1:
        parser.error("--shards, --workers and --cpus begin at 1, --retries at 0")
    if args.address and args.workers:
        parser.error("a cluster knows its workers; give --address or --workers")
    return args


def begin(args: argparse.Namespace) -> None:
    quiet = {"log_to_driver": False, "logging_level": "ERROR"}
    if args.address:
        ray.init(address=args.address, **quiet)
    else:
        cpus = args.workers * args.cpus if args.workers else max(os.cpu_count() or 1, args.cpus)
        ray.init(num_cpus=cpus, include_dashboard=False, **quiet)


def main(words: Optional[List[str]] = None) -> int:
    args = arguments(words)
    if ray is None:
        print("error: Ray is not installed; install it with pip install 'palpate[ray]'", file=sys.stderr)
        return 2
    begin(args)
    task = ray.remote(fit_shard).options(num_cpus=args.cpus, max_retries=args.retries, retry_exceptions=[Killed])
    # The interpreter of a worker is that of the driver.
    program = [args.palpate] if args.palpate else [sys.executable, "-m", "palpate"]
    waiting = {}
    # A worker has a folder of its own, so a path from here would mean something else there.
    lake = os.path.abspath(args.lake)
    for number in range(1, args.shards + 1):
        shard = f"{number}/{args.shards}"
        command = [*program, "fit", lake, "--shard", shard, "--jobs", str(args.cpus), "--json", *args.fit]
        waiting[task.remote(command)] = shard
    start, totals, failed = time.monotonic(), {"made": 0, "were_there": 0, "rejected": 0}, {}
    while waiting:
        (done,), _ = ray.wait(list(waiting), num_returns=1)
        shard = waiting.pop(done)
        try:
            code, report, said = ray.get(done)
        except (ray.exceptions.RayError, Killed, OSError, ValueError) as problem:
            # The cause, not Ray's account of where it came from.
            code, report, said = 1, {}, str(getattr(problem, "cause", None) or problem).splitlines()[0]
        if code != 0:
            reasons = [f"{one['session_id']}: {one['error']}" for one in report.get("failed", [])]
            failed[shard] = reasons or [report.get("error") or said]
        for key in totals:
            totals[key] += report.get(key, 0)
        ended = args.shards - len(waiting)
        left = (time.monotonic() - start) / ended * len(waiting)
        print(f"{ended} of {args.shards} shards, about {left:.0f} s left", file=sys.stderr, flush=True)
    print(f"{totals['made']} fits made, {totals['were_there']} already present, {totals['rejected']} sessions rejected, "
          f"{len(failed)} of {args.shards} shards failed")
    for shard, reasons in sorted(failed.items(), key=lambda one: int(one[0].partition("/")[0])):
        for reason in reasons:
            print(f"shard {shard}: {reason}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
