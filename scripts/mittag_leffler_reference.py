#!/usr/bin/env python3
"""Writes model/tests/data/mittag_leffler_reference.txt: E_alpha(-x) in 25 digits.

Usage: scripts/mittag_leffler_reference.py > model/tests/data/mittag_leffler_reference.txt      (needs mpmath, 1.4.1 used)
"""
from mpmath import gamma, invertlaplace, mp, mpf, nstr

HEADER = """\
# E_alpha(-x), for checking model/src/viscoelastic/mittag_leffler.rs.
# Made by scripts/mittag_leffler_reference.py with mpmath, 25 digits shown: the power series where x^(1/alpha) < 40, in enough
# digits; beyond it Talbot's inversion of the Laplace transform z^(alpha-1) / (z^alpha + x) at time one. Where both can, they agree.
# alpha x value (alpha and x are the exact doubles nearest the decimals shown)"""

ALPHAS = [1e-3, 0.01, 0.05, 0.1, 0.25, 0.4, 0.499, 0.5, 0.501, 0.6, 0.75, 0.9, 0.95, 0.99, 0.999, 1 - 1e-6]
POSITIONS = [10 ** (i / 2 - 9) for i in range(37)] + [0.5, 1.5, 3.0, 7.0, 12.0, 20.0, 30.0, 50.0, 80.0, 200.0]


def by_series(alpha, x):
    with mp.workdps(60 + int(1.2 * x ** (1 / alpha))):
        total, k, term = mpf(0), 0, mpf(1)
        while abs(term) > mpf(10) ** -45:
            term = (-x) ** k / gamma(alpha * k + 1)
            total += term
            k += 1
        return +total


def by_inversion(alpha, x):
    with mp.workdps(60):
        return invertlaplace(lambda z: z ** (alpha - 1) / (z**alpha + x), 1, method="talbot")


def value(alpha, x):
    power = x ** (1 / alpha)
    # At a small alpha the series takes too many terms.
    can_series = power < 40 and (alpha >= 0.05 or x < 0.5)
    if not can_series:
        return by_inversion(alpha, x)
    found = by_series(alpha, x)
    assert abs(by_inversion(alpha, x) / found - 1) < mpf(10) ** -25, (alpha, x)
    return found


def main():
    mp.dps = 50
    print(HEADER)
    for alpha in ALPHAS:
        for x in POSITIONS:
            print(repr(alpha), repr(float(x)), nstr(value(mpf(alpha), mpf(x)), 25))


main()
