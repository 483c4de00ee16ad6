#!/usr/bin/env python3
"""Reference accelerations of the star of two-link arms in tests/stability/straight_arms.rs, with 60 digits.

Solves [M J^T; J 0] [a; -l] = [f; 0] at rest for the same double-precision geometry as the test. At kink 0 the constraints
depend on each other; they get a compliance of 1e-22 there, which leaves about ten digits.

    pip install mpmath; scripts/stability/kinks.py
"""
import math

from mpmath import lu_solve, matrix, mp, mpf

mp.dps = 60
SHAPES = {"EQUAL": [1.0] * 6, "MIXED": [1.0, 1.3, 0.1, 7.0, 1.0, 2.0]}


def star(kinks):
    """Bodies (center, mass, inertia) and pins (a, b, place), ground -1; in double precision, operation by operation."""
    bodies, pins = [((0.0, 0.0), 1.0, 0.3)], []

    def rod(p, q):
        length = math.hypot(q[0] - p[0], q[1] - p[1])
        bodies.append(((0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])), length, length * (length * length) / 12.0))
        return len(bodies) - 1

    for k, kink in enumerate(kinks):
        a = 0.6435 + 0.7 * k
        at = (0.2 * math.cos(a), 0.2 * math.sin(a))
        knee = (at[0] + 0.5 * math.cos(a), at[1] + 0.5 * math.sin(a))
        b = a + kink
        foot = (knee[0] + 0.5 * math.cos(b), knee[1] + 0.5 * math.sin(b))
        upper, lower = rod(at, knee), rod(knee, foot)
        pins += [(0, upper, at), (upper, lower, knee), (lower, -1, foot)]
    return bodies, pins


def shuttle(kinks, compliance):
    bodies, pins = star(kinks)
    n, m = 3 * len(bodies), 2 * len(pins)
    a, b = matrix(n + m, n + m), matrix(n + m, 1)
    for k, (_, mass, inertia) in enumerate(bodies):
        force = (0.3 + 0.1 * k, 1.0 - 0.2 * k, 0.5 * (k - 3.0))
        for i, x in enumerate((mass, mass, inertia)):
            a[3 * k + i, 3 * k + i] = x
            b[3 * k + i] = force[i]
    for l, (one, other, at) in enumerate(pins):
        for body, sign in ((one, -1), (other, 1)):
            if body < 0:
                continue
            arm = [mpf(at[i] - bodies[body][0][i]) for i in range(2)]
            for i, lever in enumerate((-arm[1], arm[0])):
                row = n + 2 * l + i
                for column, x in ((3 * body + i, mpf(sign)), (3 * body + 2, sign * lever)):
                    a[row, column] = a[column, row] = x
    for row in range(n, n + m):
        a[row, row] = -compliance
    x = lu_solve(a, b)
    return [float(x[i]) for i in range(3)]


for name, shape in SHAPES.items():
    for size in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        print(name, size, [repr(x) for x in shuttle([size * s for s in shape], mpf(0))])
print("STRAIGHT", 0, [repr(x) for x in shuttle([0.0] * 6, mpf("1e-22"))])
