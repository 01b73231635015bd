#!/usr/bin/env python3
"""Chooses the speed that determines a parameter best for the time it takes, on a rig that a person has armed.

    palpate serve --time-scale max --arm examples/speeds.toml
    pip install ./python scikit-learn
    python3 examples/choose-speed.py --token TOKEN

A slow ramp takes longer, a fast one has fewer samples. Runs can be repeated: the relative error falls with the root of their
number, so what counts is the relative error that a minute of rig time leaves, error * sqrt(time). A Gaussian process learns
how it depends on the speed, and the next run is where it may be lowest.
"""
import argparse
import math
import re
import warnings

import numpy as np
from palpate.station import Station, StationError
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

# Speeds beyond those that have run are looked for at so many points, evenly on a logarithmic axis.
CANDIDATES = 200


def learn(speeds, figures):
    """What is known about the logarithm of the figure at a speed. A length of 1 is a factor of e in speed; repeats differ."""
    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * RBF(1.0, (0.3, 5.0)) + WhiteKernel(1e-2, (1e-4, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=1)
    with warnings.catch_warnings():
        # Few runs leave a length at its bound.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return process.fit(np.log(speeds)[:, None], np.log(figures))


def next_speed(speeds, figures, low, high):
    """The ends and the middle first; then where the lower end of the 95 % interval is lowest."""
    ends = [low, high, math.sqrt(low * high)]
    if len(speeds) < len(ends):
        return ends[len(speeds)]
    grid = np.geomspace(low, high, CANDIDATES)
    mean, deviation = learn(speeds, figures).predict(np.log(grid)[:, None], return_std=True)
    return float(grid[np.argmin(mean - 1.96 * deviation)])


def ask(station, speed, step, allowed):
    """Asks for a run at the nearest speed that the rig can do; its number, the speed and the step."""
    low, high, unit = allowed
    if step:
        # The forgiveness is that of decimal fractions, as in 0.3 / 0.1.
        speed = step * min(max(round(speed / step), math.ceil(low / step - 1e-9)), math.floor(high / step + 1e-9))
    try:
        return station.ask({"speed": f"{speed:.9g} {unit}"}, "choose-speed"), speed, step
    except StationError as refusal:
        # The refusal names the step of the motor's speeds.
        named = re.search(r"multiples of ([\d.e-]+) ", str(refusal))
        if step or refusal.status != 400 or not named:
            raise
        return ask(station, speed, float(named[1]), allowed)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--url", default="http://127.0.0.1:7480")
    parser.add_argument("--token", required=True, help="of 'palpate token add NAME --scope watch,run'")
    parser.add_argument("--certificate", help="of the station, where the system does not know who has signed it")
    parser.add_argument("--parameter", default="mu1")
    parser.add_argument("--runs", type=int, default=12)
    how = parser.parse_args()
    station = Station(how.url, how.token, how.certificate)
    armed = station.armed()
    if armed is None or "speed" not in armed["choose"]:
        raise SystemExit("no queue is armed that lets a program choose the speed; arm examples/speeds.toml at the rig")
    low, high, unit = armed["choose"]["speed"]
    speeds, figures, step = [], [], 0.0
    print(f"run  speed {unit}  rig time s  {how.parameter}  relative error %  % after a minute")
    for _ in range(min(how.runs, armed["runs_left"])):
        number, speed, step = ask(station, next_speed(speeds, figures, low, high), step, armed["choose"]["speed"])
        run = station.wait(number)
        if run["ending"] != "finish" or "parameters" not in run["fit"]:
            raise SystemExit(f"run {number} is of no use: {(run['fit'] or {}).get('error') or run['reason']}")
        found = next((one for one in run["fit"]["parameters"] if one["name"] == how.parameter), None)
        if found is None or not found["std_error"]:
            raise SystemExit(f"run {number} has no error of '{how.parameter}'; choose another parameter")
        seconds = next(one["duration_s"] for one in station.sessions() if one["folder"].endswith(run["session"]))
        error = found["std_error"] / abs(found["value"])
        speeds.append(speed)
        figures.append(error * math.sqrt(seconds / 60))
        row = f"{number:3d}  {speed:10.4g}  {seconds:10.1f}  {found['value']:6.4g}  {100 * error:16.3f}  {100 * figures[-1]:16.3f}"
        print(row, flush=True)
    means = learn(speeds, figures).predict(np.log(speeds)[:, None])
    best = int(np.argmin(means))
    print(f"best speed: {speeds[best]:.4g} {unit}, {100 * math.exp(means[best]):.3f} % after a minute of rig time")
    slowest = speeds.index(min(speeds))
    # The error falls with the root of the time.
    longer = math.exp(2 * (means[slowest] - means[best]))
    print(f"the slowest, {speeds[slowest]:.4g} {unit}, needs {longer:.2g} times as long for the same error")


if __name__ == "__main__":
    main()
