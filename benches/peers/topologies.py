"""The planar mechanisms that the peers are measured on: rods of 1 m and 1 kg on frictionless pins, with gravity.

chain    N rods in a row, the first on ground
bank     a free hub held by N two-rod arms, each pinned to ground and to the hub; kinked by 0.3 rad
straight the same with straight arms, as banks are drawn: a singular configuration
ladder   two rails of N rods from ground, the ends of each pair of rods joined by a rung

`bodies` is what the figures are divided by for a chain, `loops` for the others: one loop an arm (the hub is free, so that
every arm closes one), one a rung.
"""

import math
from dataclasses import dataclass, replace

GRAVITY = 9.81
TURN = 0.6435  # rad: nothing lies along an axis
KINK = 0.3


@dataclass(frozen=True)
class Drawing:
    """`angles[i]` is the angle of rod i to the x axis; `start[i]` where it starts; `name` what it is called, if not by its kind."""

    kind: str
    count: int
    angles: tuple
    start: tuple
    name: str = ""

    @property
    def label(self):
        return self.name or self.kind

    @property
    def loops(self):
        return 0 if self.kind == "chain" else self.count

    @property
    def per(self):
        return self.count


def along(angle, length=1.0):
    return (length * math.cos(angle), length * math.sin(angle))


def chain(count):
    angles, start, at = [], [], (0.0, 0.0)
    for k in range(count):
        angle = -0.3 + 0.1 * math.sin(k)
        angles.append(angle)
        start.append(at)
        step = along(angle)
        at = (at[0] + step[0], at[1] + step[1])
    return Drawing("chain", count, tuple(angles), tuple(start))


def bank(count, kink=KINK):
    """Rods 2k (from ground) and 2k + 1 (to the hub at the origin), the k-th arm's ground pin in its own direction."""
    angles, start = [], []
    for k in range(count):
        angle = TURN + 2 * math.pi * k / count
        first, second = angle + kink / 2, angle - kink / 2
        elbow = tuple(-x for x in along(second))
        foot = tuple(e - x for e, x in zip(elbow, along(first)))
        angles += [first, second]
        start += [foot, elbow]
    return Drawing("bank", count, tuple(angles), tuple(start))


def ladder(count):
    """Rods 3k, 3k + 1 (rails) and 3k + 2 (rung, from rail 0 to rail 1)."""
    angles, start = [], []
    for k in range(count):
        base = along(TURN, k)
        other = along(TURN + math.pi / 2)
        angles += [TURN, TURN, TURN + math.pi / 2]
        start += [base, (base[0] + other[0], base[1] + other[1]), along(TURN, k + 1)]
    return Drawing("ladder", count, tuple(angles), tuple(start))


def straight(count):
    return replace(bank(count, 0.0), name="straight")


MAKE = {"chain": chain, "bank": bank, "straight": straight, "ladder": ladder}
