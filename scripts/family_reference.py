#!/usr/bin/env python3
"""Forces of every model family in 25 digits, for model/rheology/tests/data/family_reference.txt.

Usage: scripts/family_reference.py > model/rheology/tests/data/family_reference.txt   (needs mpmath)

Every number is an integral over the depth history evaluated by quadrature: of the equation's
exponential kernel, of the relaxation function with its exponential integrals, or of the
Mittag-Leffler function summed as a power series. Nothing here is shared with the code under test.
"""
from mpmath import mp, mpf, quad, exp, log, e1, gamma

mp.dps = 40

# Corners of the path: a ramp, a hold, part of the way back, out of contact, a second ramp; then deeper
# than ever before and back, for families that depend on the greatest depth so far.
PATH = [(0, 0), (2.5, 10), (6, 10), (8, 4), (9, -2), (9.5, -2), (12, 8), (13, 13), (14, 6)]
TIMES = [1, 2.5, 3, 6, 7, 8, 8.5, 9.25, 11, 12]
LATER = [12.3, 12.7, 13, 13.5, 14]


def pieces(until):
    """Straight pieces in contact up to a time: (start, end, depth at start, speed)."""
    found = []
    for (t0, x0), (t1, x1) in zip(PATH, PATH[1:]):
        t0, x0, t1, x1 = map(mpf, (t0, x0, t1, x1))
        v = (x1 - x0) / (t1 - t0)
        cuts = [t0, t1]
        if x0 * x1 < 0:
            cuts = [t0, t0 - x0 / v, t1]
        for a, b in zip(cuts, cuts[1:]):
            b = min(b, until)
            if b > a:
                middle = x0 + v * ((a + b) / 2 - t0)
                inside = middle > 0
                found.append((a, b, x0 + v * (a - t0) if inside else mpf(0), v if inside else mpf(0)))
    return found


def integral(until, f):
    """Integral over the history of f(s, depth, speed)."""
    total = mpf(0)
    for a, b, x, v in pieces(until):
        # Quadrature in parts: kernels are sharp near the present.
        cuts = [a + (b - a) * k / 8 for k in range(9)]
        total += quad(lambda s: f(s, x + v * (s - a), v), cuts)
    return total


def depth(until):
    a, b, x, v = pieces(until)[-1]
    return x + v * (b - a), v


def differential(t, tau, u):
    """F + tau F' = u(x, v)."""
    return integral(t, lambda s, x, v: exp(-(t - s) / tau) * u(x, v) / tau)


def unloading(t, o, l):
    """The series with three softening terms; the path as function of time and its maximum so far."""
    tau, (*mu, viscous, s1, s2, s3) = o[0], l
    total = mpf(0)
    deepest = mpf(0)
    for a, b, x, v in pieces(t):
        # Cut where the greatest depth so far is reached.
        cuts = [a, b]
        if x < deepest < x + v * (b - a):
            cuts = [a, a + (deepest - x) / v, b]
        for c, d in zip(cuts, cuts[1:]):
            y = x + v * (c - a)
            # Halfway, for the cut is rounded.
            is_new = v > 0 and y + v * (d - c) / 2 > deepest
            before = deepest
            def u(s):
                z = y + v * (s - c)
                first = sum(m * z ** (k + 1) for k, m in enumerate(mu)) + viscous * z * v
                greatest = z if is_new else before
                lost = (s1 * z + s2 * z ** 2 + s3 * z ** 3) * (1 - z / greatest) if greatest > 0 else 0
                return exp(-(t - s) / tau) * (first + lost) / tau
            total += quad(u, [c + (d - c) * k / 8 for k in range(9)])
            deepest = max(deepest, y + v * (d - c))
    return total


def hereditary(t, modulus, slope):
    """F = int G(t - s) dT/dx v ds."""
    return integral(t, lambda s, x, v: modulus(t - s) * slope(x) * v if v != 0 else mpf(0))


def mittag_leffler(alpha, z):
    """E_alpha(-z), z >= 0, by its series in enough digits."""
    with mp.workdps(40 + int(3 * float(z) ** (1 / float(alpha))) + 20):
        total, k = mpf(0), 0
        while True:
            term = (-z) ** k / gamma(alpha * k + 1)
            total += term
            k += 1
            if k > 5 and abs(term) < mpf(10) ** -45:
                return total


def fung(t, tau_1, ratio, b, a_inf, a_c):
    tau_1, ratio, b, a_inf, a_c = map(mpf, (tau_1, ratio, b, a_inf, a_c))
    tau_2 = tau_1 * ratio
    def modulus(s):
        if s == 0:
            return a_inf + a_c * log(ratio)
        return a_inf + a_c * (e1(s / tau_2) - e1(s / tau_1))
    return hereditary(t, modulus, lambda x: b * exp(b * x))


FAMILIES = {
    "voigt": ([], [0.2, 0.15], lambda t, o, l: l[0] * depth(t)[0] + l[1] * depth(t)[1]),
    "maxwell": ([8], [0.3], lambda t, o, l: differential(t, o[0], lambda x, v: l[0] * o[0] * v)),
    "kelvin": ([1.7], [0.15, 0.6], lambda t, o, l: differential(t, o[0], lambda x, v: l[0] * x + l[1] * v)),
    "series-1": ([1.3], [0.12, 0.05], None),
    "series-2": ([1.3], [0.05, 0.01, 0.05], None),
    "series-3": ([1.023], [0.05333, -0.0086, 0.0004345, 0.06], None),
    "series-4": ([1.2], [0.08, -0.012, 0.0004, 3e-5, 0.05], None),
    "series-5": ([1.2], [0.08, -0.02, 0.003, -2e-4, 5e-6, 0.05], None),
    "unloading-2": ([1.3], [0.05, 0.01, 0.05, -0.02, -0.004, -1e-4], unloading),
    "unloading-3": ([1.023], [0.05333, -0.0086, 0.0004345, 0.06, -0.02, 0.003, -2e-4], unloading),
    "exponential": ([1.5, 0.15], [0.3, 0.9], lambda t, o, l: differential(
        t, o[0], lambda x, v: l[0] * (exp(o[1] * x) - 1) + l[1] * o[1] * v * exp(o[1] * x))),
    "prony-3": ([0.2, 2, 20], [0.1, 0.1, 0.08, 0.06], lambda t, o, l: hereditary(
        t, lambda s: l[0] + sum(k * exp(-s / tau) for k, tau in zip(l[1:], o)), lambda x: mpf(1))),
    "fractional": ([2, 0.5], [0.1, 0.3], lambda t, o, l: hereditary(
        t, lambda s: l[0] + l[1] * mittag_leffler(o[1], (s / o[0]) ** o[1]), lambda x: mpf(1))),
    "fung": ([0.1, 300, 0.15], [0.15, 0.06], lambda t, o, l: fung(t, *o, *l)),
    "stretched": ([2, 0.5], [0.1, 0.3], lambda t, o, l: hereditary(
        t, lambda s: l[0] + l[1] * exp(-(s / o[0]) ** o[1]), lambda x: mpf(1))),
}


def series(t, o, l):
    *mu, viscous = l
    return differential(t, o[0], lambda x, v: sum(m * x ** (k + 1) for k, m in enumerate(mu)) + viscous * x * v)


print("# Forces in N of every family along the path of scripts/family_reference.py, which made this file.")
print("# family / outer parameters / coefficients / time in s / force")
for name, (outer, linear, force) in FAMILIES.items():
    # The numbers as the code under test holds them.
    o, l = [mpf(float(v)) for v in outer], [mpf(float(v)) for v in linear]
    for t in TIMES + LATER * name.startswith("unloading"):
        value = (force or series)(mpf(t), o, l)
        words = [name, ",".join(map(repr, map(float, outer))), ",".join(map(repr, map(float, linear)))]
        print(" / ".join(words + [repr(float(t)), mp.nstr(value, 25)]))
