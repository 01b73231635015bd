#!/usr/bin/env python3
"""Cramer-Rao bound of a contact position from one slow pass, in 50 digits: numbers of tests/tests/suite/contact.rs.

The body's force on the way in at constant speed is a_1 d psi_1 + a_2 d^2 psi_2 + a_3 d^3 psi_3 of r = d / (v tau),
with psi_k(r) = exp(-r) integral of exp(s) (s/r)^k over 0..r; unknown are contact, level, offset and drift.

Usage: scripts/contact_bound.py   (needs mpmath)
"""
from mpmath import exp, matrix, mp, mpf, sqrt

mp.dps = 50
TAU, MU, TAU_SIG = mpf("1.023"), [mpf("0.05333"), mpf("-0.0086"), mpf("0.0004345")], mpf("0.06")


def filtered(k, d, scale):
    """y with y + scale y' = d^k from rest at d = 0: the polynomial particular solution, minus its value at 0 decaying."""
    coefficients, factor = [], mpf(1)
    for j in range(k + 1):
        coefficients.append((factor, k - j))
        factor *= -scale * (k - j)
    at_zero = coefficients[-1][0]
    value = sum(c * d**p for c, p in coefficients)
    slope = sum(c * p * d ** (p - 1) for c, p in coefficients if p > 0)
    decay = exp(-d / scale)
    return value - at_zero * decay, slope + at_zero * decay / scale


def bound(low, high, speed, noise):
    low, high, speed, noise = (mpf(text) for text in (low, high, speed, noise))
    a = [MU[0] + TAU_SIG * speed, MU[1], MU[2]]
    count = int((high - low) / (speed / 1000))
    information = matrix(4, 4)
    for i in range(1, count + 1):
        d = low + speed * i / 1000
        force = slope = mpf(0)
        if d > 0:
            for k in range(3):
                value, rise = filtered(k + 1, d, speed * TAU)
                force += a[k] * value
                slope += a[k] * rise
        row = [-slope, force, mpf(1), mpf(i) / count]
        for p in range(4):
            for q in range(4):
                information[p, q] += row[p] * row[q] / noise**2
    return sqrt((information**-1)[0, 0])


for case in [("-3", "2.35", "0.15", "0.05"), ("-2", "3.3", "0.18", "0.05")]:
    print(*case, mp.nstr(bound(*case), 20))
