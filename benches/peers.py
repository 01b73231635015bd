#!/usr/bin/env python3
"""scipy and lmfit on the record of fit-peers, with the exact model, vectorised. Prints JSON.

Usage: peers.py RECORD TAU_START [--skip-intervals]
RECORD holds t, depth, force, noisy force, one array after the other, as little-endian doubles.
"""
import json
import math
import statistics
import sys
import time

import lmfit
import numpy as np
import scipy
from scipy.optimize import least_squares
from scipy.signal import lfilter

NAMES = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig", "f0", "f_offset"]


def psi(r):
    """psi_0..psi_3 by their series below 1, by the recurrence above."""
    if r >= 1:
        values = [-math.expm1(-r)]
        for j in (1, 2, 3):
            values.append(1 - j / r * values[-1])
        return values
    values = []
    for j in range(4):
        term, total, m = r / (j + 1), 0.0, 0
        while abs(term) > 1e-20 * r:
            total += term
            m += 1
            term *= -r / (m + j + 1)
        values.append(total)
    return values


class Model:
    """The exact response to depth that moves straight between evenly spaced samples."""

    def __init__(self, t, x):
        self.t = t - t[0]
        self.h = (t[-1] - t[0]) / (len(t) - 1)
        assert np.allclose(np.diff(t), self.h, rtol=1e-6), "lfilter needs even sampling"
        x0, d = x[:-1], np.diff(x)
        # Rows to be weighted by psi_0..psi_3, for x, x^2, x^3; formed once, not in each call.
        self.parts = [
            [x0, d],
            [x0**2, 2 * x0 * d, d**2],
            [x0**3, 3 * x0**2 * d, 3 * x0 * d**2, d**3],
        ]
        self.rate = d / self.h

    def drives(self, tau):
        """Step over tau, and the weighted forcing of x, x^2, x^3."""
        r = self.h / tau
        weights = psi(r)
        return r, [sum(w * part for w, part in zip(weights, parts)) for parts in self.parts]

    def force_by_column(self, p):
        """The same model as most would write it: filter every column, then combine."""
        tau, mu1, mu2, mu3, tau_sig, f0, f_offset = p
        if tau <= 0:
            return np.full(len(self.t), 1e6)
        r, (first, second, third) = self.drives(tau)

        def filtered(drive):
            return np.concatenate(([0.0], lfilter([1.0], [1.0, -math.exp(-r)], drive)))

        columns = np.stack([filtered(first), filtered(second), filtered(third),
                            filtered(self.rate * first), np.exp(-self.t / tau), np.ones(len(self.t))], axis=1)
        return columns @ np.array([mu1, mu2, mu3, tau_sig, f0, f_offset])

    def force(self, p):
        tau, mu1, mu2, mu3, tau_sig, f0, f_offset = p
        if tau <= 0:
            # LM knows no bounds; a residual this large makes it take a shorter step.
            return np.full(len(self.t), 1e6)
        r, (first, second, third) = self.drives(tau)
        # The filter is linear, so one pass over the weighted sum serves all columns.
        drive = mu1 * first + mu2 * second + mu3 * third + tau_sig * self.rate * first
        force = np.empty(len(self.t))
        force[0] = 0.0
        force[1:] = lfilter([1.0], [1.0, -math.exp(-r)], drive)
        return force + f0 * np.exp(-self.t / tau) + f_offset


def timed(work, repeats=3):
    times, result = [], None
    for _ in range(repeats):
        begin = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), result


def covariance(solution, count):
    scatter = 2 * solution.cost / (count - len(solution.x))
    return np.sqrt(np.diag(np.linalg.inv(solution.jac.T @ solution.jac)) * scatter)


def entry(name, record, seconds, values, errors):
    return {"name": name, "record": record, "seconds": seconds, "values": list(map(float, values[:5])),
            "std_errors": list(map(float, errors[:5]))}


def main():
    t, x, clean, noisy = np.fromfile(sys.argv[1], dtype="<f8").reshape(4, -1)
    tau_start = float(sys.argv[2])
    model = Model(t, x)
    fits = []
    for record, force in (("noiseless", clean), ("noisy", noisy)):
        # What a careful user starts from: a guess at tau, elastic coefficients from a polynomial
        # through force against depth, no viscosity, no initial force, no offset.
        elastic = np.linalg.lstsq(np.stack([x, x**2, x**3], axis=1), force, rcond=None)[0]
        start = np.array([tau_start, *elastic, 0.0, 0.0, 0.0])

        def residual(p):
            return model.force(p) - force

        def lm():
            solution = least_squares(residual, start, method="lm")
            return solution, covariance(solution, len(t))

        low = [1e-3] + [-np.inf] * 6

        def trf():
            solution = least_squares(residual, start, method="trf", bounds=(low, np.inf))
            return solution, covariance(solution, len(t))

        for name, work in (("scipy LM", lm), ("scipy TRF, bounds", trf)):
            seconds, (solution, errors) = timed(work)
            fits.append(entry(name, record, seconds, solution.x, errors))

        def of(params):
            return residual([params[name].value for name in NAMES])

        params = lmfit.Parameters()
        for name, value in zip(NAMES, start):
            params.add(name, value=value, min=1e-3 if name == "tau_eps" else -np.inf)
        seconds, result = timed(lambda: lmfit.minimize(of, params, method="leastsq"))
        fits.append(entry("lmfit leastsq", record, seconds, [result.params[n].value for n in NAMES],
                          [result.params[n].stderr or math.nan for n in NAMES]))

        def by_column(params):
            return model.force_by_column([params[name].value for name in NAMES]) - force

        seconds, result = timed(lambda: lmfit.minimize(by_column, params, method="leastsq"))
        fits.append(entry("lmfit, by column", record, seconds, [result.params[n].value for n in NAMES],
                          [result.params[n].stderr or math.nan for n in NAMES]))
    intervals = None
    if "--skip-intervals" not in sys.argv:
        # Of the noisy record, the last; f0 and f_offset kept at 0, which is cheaper for lmfit.
        params["f0"].set(value=0.0, vary=False)
        params["f_offset"].set(value=0.0, vary=False)
        minimizer = lmfit.Minimizer(of, params)
        best = minimizer.minimize(method="leastsq")
        seconds, found = timed(lambda: lmfit.conf_interval(minimizer, best, p_names=NAMES[:5], sigmas=[0.95]), 1)
        bounds = [[found[name][0][1], found[name][-1][1]] for name in NAMES[:5]]
        intervals = {"seconds": seconds, "bounds": bounds}
    json.dump({"python": sys.version.split()[0], "numpy": np.__version__, "scipy": scipy.__version__,
               "lmfit": lmfit.__version__, "fits": fits, "intervals": intervals}, sys.stdout)


main()
