"""Speed of the installed Python package: a figure from nothing, a fit of 90 001 samples beside the same call in Rust, and ten
million samples as a data frame beside the same in Parquet. `scripts/python-package --profile release --measure` runs it."""
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import palpate
import polars


def timed(work, turns=5):
    """Median of the seconds of some turns, and the last result."""
    seconds = []
    for _ in range(turns):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), min(seconds), max(seconds), result


def record():
    """The thesis protocol: 0.75 mm/s to 30 mm, 50 s hold, 1 kHz; a body of springs and a dashpot, with noise."""
    t = np.arange(90_001) * 1e-3
    depth = np.minimum(0.75 * t, 30.0)
    increments = np.diff(depth, prepend=0.0)
    # One relaxation time, exactly along the ramp.
    decay, slow, fast = np.exp(-1e-3 / 1.0), 0.05 * depth, np.zeros(len(t))
    for i in range(1, len(t)):
        fast[i] = fast[i - 1] * decay + 0.05 * increments[i]
    return t, depth, slow + fast + np.random.default_rng(1).normal(0, 0.02, len(t))


def main():
    folder = pathlib.Path(sys.argv[1])
    arrays = record()
    median, low, high, fit = timed(lambda: palpate.fit(*arrays, family="prony-1"), 11)
    inside = statistics.median(palpate.fit(*arrays, family="prony-1")["seconds"] for _ in range(11))
    print(f"palpate.fit of {fit['samples']} samples: {1e3 * median:.2f} ms ({1e3 * low:.2f} to {1e3 * high:.2f}), of which the fit in "
          f"Rust {1e3 * inside:.2f} ms")
    default, *_ = timed(lambda: palpate.fit(*arrays), 11)
    inside = statistics.median(palpate.fit(*arrays)["seconds"] for _ in range(11))
    print(f"the same with the default model: {1e3 * default:.2f} ms, of which the fit in Rust {1e3 * inside:.2f} ms")

    command = [sys.executable, "-m", "palpate"]
    session, file = folder / "long", folder / "long.parquet"
    long = ["run", "ramp-hold", "--rate", "20000", "--hold", "335", "--time-scale", "max", "--out", session]
    subprocess.run([*command, *long], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    export = ["export", session, "--format", "parquet", "--to", folder]
    subprocess.run([*command, *export], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    opening, *_, opened = timed(lambda: palpate.open(session))
    ours, low, high, samples = timed(opened.samples)
    theirs, lowest, highest, frame = timed(lambda: polars.read_parquet(file))
    assert samples.equals(frame)
    arrow, *_ = timed(lambda: opened.samples("arrow"))
    print(f"{len(samples)} samples to polars: {ours:.2f} s from the log ({low:.2f} to {high:.2f}), after {opening:.2f} s to open and "
          f"check it; polars reads the same as Parquet, {file.stat().st_size / 1e6:.0f} MB, in {theirs:.2f} s ({lowest:.2f} to "
          f"{highest:.2f}); to pyarrow {arrow:.2f} s")

    with tempfile.TemporaryDirectory() as place:
        short = ["run", "ramp-hold", "--time-scale", "max", "--out", f"{place}/demo"]
        subprocess.run([*command, *short], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        code = "import palpate; s = palpate.open('demo'); palpate.plot(s, fit=s.fit()).figure.savefig('demo.png')"
        first, *_ = timed(lambda: subprocess.run([sys.executable, "-c", code], cwd=place, check=True), 3)
        bare, *_ = timed(lambda: subprocess.run([sys.executable, "-c", "import palpate"], check=True), 3)
        size = len(palpate.open(f"{place}/demo"))
    print(f"a session of {size} samples opened, fitted and drawn in a new interpreter: {first:.2f} s; import palpate {bare:.2f} s")


if __name__ == "__main__":
    main()
