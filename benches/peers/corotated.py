"""The reference of transients.py: scripts/frames/corotational.py in time, by the implicit midpoint rule, extrapolated.

Elements are those of that program. Masses are those of each half at its node but for a sixth, which couples both ends: consistent to fourth order. Meshes
and steps are halved, and the error that each halving changes is extrapolated by its order.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "scripts"))

from frames.corotational import Frame  # noqa: E402


class Corotated(Frame):
    """The elements of `structure` with `finest` of the bar that has most."""

    def __init__(self, structure, finest):
        places, elements = structure.divided(finest)
        self.places = np.array(places)
        self.ends = np.array([(i, j) for _, i, j in elements])
        chord = self.places[self.ends[:, 1]] - self.places[self.ends[:, 0]]
        self.length, self.angle = np.hypot(chord[:, 0], chord[:, 1]), np.arctan2(chord[:, 1], chord[:, 0])
        self.ea, self.ei, self.line = (np.array([getattr(bar, name) for bar, _, _ in elements]) for name in ("ea", "ei", "line"))
        self.rest = np.zeros(len(elements))
        n = len(places)
        fixed = np.zeros((n, 3), bool)
        fixed[list(structure.anchors)] = True
        self.free = np.flatnonzero(~fixed.ravel())
        self.dofs = np.concatenate([3 * self.ends[:, :1] + [0, 1, 2], 3 * self.ends[:, 1:] + [0, 1, 2]], axis=1)
        self.load = np.zeros((n, 3))
        for node, load in structure.loads.items():
            self.load[node] += load
        self.load = self.load.ravel()
        self.scale = float(np.max(self.length)) * finest
        self._pattern(n)
        self.stops = structure.stops
        self.m = self._masses(structure, structure.rotary(elements, self.length))

    def _pattern(self, n):
        rows, cols = np.repeat(self.dofs, 6, axis=1).ravel(), np.tile(self.dofs, (1, 6)).ravel()
        number = np.full(3 * n, -1)
        number[self.free] = np.arange(len(self.free))
        r, c, size = number[rows], number[cols], len(self.free)
        self.kept = (r >= 0) & (c >= 0)
        keys = c[self.kept] * size + r[self.kept]
        unique, self.place = np.unique(keys, return_inverse=True)
        self.rows, self.count = unique % size, len(unique)
        self.starts = np.searchsorted(unique // size, np.arange(size + 1))

    def _assemble(self, blocks):
        data = np.bincount(self.place, blocks.ravel()[self.kept], self.count)
        size = len(self.free)
        return csc_matrix((data, self.rows, self.starts), shape=(size, size))

    def evaluate(self, u, s=1.0):
        residual, tangent, strain = super().evaluate(u, s)
        for stop in self.stops:
            dof = 3 * stop.node + 1
            p = -u[dof] - stop.gap
            residual[dof] -= stop.force(p)
            k = np.searchsorted(self.free, dof)
            tangent[k, k] += stop.tangent(p)
        return residual, tangent, strain

    def _masses(self, structure, rotary):
        w = self.line * self.length
        blocks = np.zeros((len(w), 6, 6))
        for axis in (0, 1):
            for i, j, part in ((axis, axis, 5), (axis + 3, axis + 3, 5), (axis, axis + 3, 1), (axis + 3, axis, 1)):
                blocks[:, i, j] = w * part / 12
        whole = self._assemble(blocks).tolil()
        number = {dof: k for k, dof in enumerate(self.free)}
        for node, (mass, inertia) in structure.masses.items():
            for axis, value in enumerate((mass, mass, inertia)):
                whole[number[3 * node + axis], number[3 * node + axis]] += value
        for node, value in rotary.items():
            if 3 * node + 2 in number:
                whole[number[3 * node + 2], number[3 * node + 2]] += value
        return whole.tocsc()

    def released(self, node, stop, intervals, substeps):
        """x and y of the node at the ends of the intervals, from the equilibrium under the loads, which are gone."""
        u, reached = self.follow()
        assert reached == 1.0, "the reference loses stability"
        h = stop / (intervals * substeps)
        rate = np.zeros(len(self.free))
        out = [u.reshape(-1, 3)[node, :2].copy()]
        stiff = self.m * (4 / h**2)
        guess = np.zeros(len(self.free))
        scale = np.where(self.free % 3 == 2, self.scale, 1.0)
        for step in range(intervals * substeps):
            middle = u.copy()
            middle[self.free] += guess
            for iteration in range(30):
                residual, tangent, _ = self.evaluate(middle, 0.0)
                change = middle[self.free] - u[self.free]
                force = residual[self.free] + self.m @ (change * (4 / h**2) - rate * (2 / h))
                delta = splu((tangent + stiff).tocsc(), permc_spec="MMD_AT_PLUS_A").solve(-force)
                middle[self.free] += delta
                size, last = np.max(np.abs(delta) * scale), size if iteration else np.inf
                # rounding keeps corrections of stiff frames above the first bound
                if size < 1e-10 * self.scale or 0.1 * last < size < 1e-7 * self.scale:
                    break
            else:
                raise RuntimeError(f"the reference finds no step at {step}: {size:e} of {self.scale:e}")
            guess = middle[self.free] - u[self.free]
            rate = 4 / h * guess - rate
            u[self.free] += 2 * guess
            if (step + 1) % substeps == 0:
                out.append(u.reshape(-1, 3)[node, :2].copy())
        return np.array(out).T
