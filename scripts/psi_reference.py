#!/usr/bin/env python3
"""Writes model/tests/data/psi_reference.txt: psi_j(r) in 50 digits.

Usage: scripts/psi_reference.py > model/tests/data/psi_reference.txt      (needs mpmath, 1.4.1 used)
"""
from mpmath import mp, mpf, nstr

# The series cancels at most e^30, 13 digits; the recurrence above it divides errors by r / j.
mp.dps = 80

HEADER = """\
# psi_j(r) = r * int_0^1 s^j exp(-r(1-s)) ds, for checking model/src/viscoelastic/psi.rs.
# Made by scripts/psi_reference.py with mpmath at 80 digits, 50 shown: for r < 30 the series
# sum_m (-1)^m r^(m+1) j!/(m+j+1)!, above it the recurrence psi_j = 1 - (j/r) psi_{j-1}.
# r: every 0.02 in 0.5..8, where a wrong switch between series and recurrence shows, then four a decade in 1e-12..1e12.
# j r psi (r is the exact double nearest the decimal shown)"""


def psi(j, r):
    if r < 30:
        term, total, m = r / (j + 1), mpf(0), 0
        while abs(term) > mpf(10) ** -85 * r:
            total += term
            m += 1
            term *= -r / (m + j + 1)
        return total
    value = -mp.expm1(-r)
    for i in range(1, j + 1):
        value = 1 - i / r * value
    return value


def main():
    radii = [0.5 + 0.02 * i for i in range(376)] + [10 ** (i / 4 - 12) for i in range(97)]
    print(HEADER)
    for j in range(6):
        for r in radii:
            print(j, repr(float(r)), nstr(psi(j, mpf(r)), 50))


main()
