"""An independent planar frame solver: corotational cubic beams whose axial strain includes the bowing of the chord. It shares no code and no
discretization with the product.

Strain energy of an element of rest length L between nodes whose sections are turned by t1 and t2 from the chord of length l:
    e = (l - L)/L + (2 t1^2 - t1 t2 + 2 t2^2)/30 - e0,   U = EA L e^2/2 + EI/(2 L) (4 t1^2 + 4 t1 t2 + 4 t2^2).
Masses are the consistent cubic ones without rotary inertia. Reference: M. A. Crisfield, "A consistent co-rotational formulation for non-linear,
three-dimensional, beam-elements", Comput. Methods Appl. Mech. Engrg. 81 (1990), in the plane.
"""

import numpy as np
from scipy import linalg
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import eigsh, splu


def elements(scene, least):
    """Elements of each beam: a power of two times `least`, each no longer than half of the length √(EI/F) within which the loads F can bend a
    beam, up to 256."""
    force = sum(abs(load.F) for load in scene.loads)
    counts = []
    for beam in scene.beams:
        length = np.hypot(*np.subtract(scene.places[beam.b], scene.places[beam.a]))
        bending = np.sqrt(scene.E * scene.h * beam.w**3 / 12 / force) if force else np.inf
        count = least
        while count < min(256, 2 * length / bending):
            count *= 2
        counts.append(count)
    return counts


class Frame:
    """Beams divided into elements, `pieces` of each beam. Coordinates: x [m], y [m], rotation [rad] of each node; `free` selects those that are
    not anchored."""

    def __init__(self, scene, pieces):
        self.scene = scene
        places = [np.array(p) for p in scene.places]
        ends, length, angle, ea, ei, rest, mass = [], [], [], [], [], [], []
        self.inner, whole = [], []
        for beam, pieces in zip(scene.beams, [pieces] * len(scene.beams) if isinstance(pieces, int) else pieces):
            a, b = beam.a, beam.b
            chord = places[b] - places[a]
            inner = list(range(len(places), len(places) + pieces - 1))
            places += [places[a] + chord * (k / pieces) for k in range(1, pieces)]
            chain = [a, *inner, b]
            self.inner.append(chain)
            whole.append(np.hypot(*chord))
            for i, j in zip(chain, chain[1:]):
                ends.append((i, j))
                length.append(np.hypot(*chord) / pieces)
                angle.append(np.arctan2(chord[1], chord[0]))
                ea.append(scene.E * beam.w * scene.h)
                ei.append(scene.E * scene.h * beam.w**3 / 12)
                rest.append(scene.expansion * beam.rise)
                mass.append(scene.density * beam.w * scene.h)
        self.places = np.array(places)
        self.ends = np.array(ends)
        self.length, self.angle = np.array(length), np.array(angle)
        self.ea, self.ei, self.rest, self.line = map(np.array, (ea, ei, rest, mass))
        n = len(places)
        fixed = np.zeros((n, 3), bool)
        fixed[list(scene.anchors)] = True
        self.free = np.flatnonzero(~fixed.ravel())
        self.dofs = np.concatenate([3 * self.ends[:, :1] + [0, 1, 2], 3 * self.ends[:, 1:] + [0, 1, 2]], axis=1)
        self.load = np.zeros((n, 3))
        for load in scene.loads:
            self.load[load.node] += [load.F * np.cos(load.oz), load.F * np.sin(load.oz), load.M]
        self.load = self.load.ravel()
        self.scale = float(np.mean(whole))

    def evaluate(self, u, s=1.0):
        """Residual [N, N·m] and stiffness at the displacements u for the fraction s of loads and temperatures, and the element strains."""
        n = len(self.places)
        u3 = u.reshape(n, 3)
        l, t1, t2, c, sn = self._chords(u3)
        L, e = self.length, self._strain(l, t1, t2, s)
        g1, g2 = (4 * t1 - t2) / 30, (4 * t2 - t1) / 30
        N, B = self.ea * e, self.ei / L
        # derivatives of the energy by (l, t1, t2)
        f = np.stack([N, N * L * g1 + B * (4 * t1 + 2 * t2), N * L * g2 + B * (4 * t2 + 2 * t1)], axis=1)
        m = len(L)
        h = np.zeros((m, 3, 3))
        de = np.stack([1 / L, g1, g2], axis=1)
        h += (self.ea * L)[:, None, None] * de[:, :, None] * de[:, None, :]
        h[:, 1, 1] += N * L * 4 / 30 + 4 * B
        h[:, 2, 2] += N * L * 4 / 30 + 4 * B
        h[:, 1, 2] += -N * L / 30 + 2 * B
        h[:, 2, 1] += -N * L / 30 + 2 * B
        zero, one = np.zeros(m), np.ones(m)
        r = np.stack([-c, -sn, zero, c, sn, zero], axis=1)
        z = np.stack([sn, -c, zero, -sn, c, zero], axis=1)
        G = np.zeros((m, 3, 6))
        G[:, 0] = r
        G[:, 1] = -z / l[:, None]
        G[:, 2] = -z / l[:, None]
        G[:, 1, 2] += one
        G[:, 2, 5] += one
        force = np.einsum("mki,mk->mi", G, f)
        K = np.swapaxes(G, 1, 2) @ h @ G
        K += (f[:, 0] / l)[:, None, None] * z[:, :, None] * z[:, None, :]
        K += ((f[:, 1] + f[:, 2]) / l**2)[:, None, None] * (r[:, :, None] * z[:, None, :] + z[:, :, None] * r[:, None, :])
        residual = np.zeros(3 * n)
        np.add.at(residual, self.dofs, force)
        residual -= s * self.load
        return residual, self._assemble(K), e

    def energy(self, u, s=1.0):
        """Strain energy less the work of the loads [J]."""
        u3 = u.reshape(-1, 3)
        l, t1, t2, _, _ = self._chords(u3)
        e = self._strain(l, t1, t2, s)
        bending = self.ei / (2 * self.length) * 4 * (t1**2 + t1 * t2 + t2**2)
        return float(np.sum(0.5 * self.ea * self.length * e**2 + bending) - s * self.load @ u)

    def _chords(self, u3):
        """Length of every chord, turns of both ends from it, and its direction."""
        i, j = self.ends[:, 0], self.ends[:, 1]
        d = self.places[j] + u3[j, :2] - self.places[i] - u3[i, :2]
        l = np.hypot(d[:, 0], d[:, 1])
        beta = np.arctan2(d[:, 1], d[:, 0]) - self.angle
        # the chord may have turned by whole circles: take the turn next to the mean of the ends
        mean = 0.5 * (u3[i, 2] + u3[j, 2])
        beta += 2 * np.pi * np.round((mean - beta) / (2 * np.pi))
        return l, u3[i, 2] - beta, u3[j, 2] - beta, d[:, 0] / l, d[:, 1] / l

    def _strain(self, l, t1, t2, s):
        return (l - self.length) / self.length + (2 * t1**2 - t1 * t2 + 2 * t2**2) / 30 - s * self.rest

    def _assemble(self, blocks):
        rows = np.repeat(self.dofs, 6, axis=1).ravel()
        cols = np.tile(self.dofs, (1, 6)).ravel()
        n = 3 * len(self.places)
        whole = coo_matrix((blocks.ravel(), (rows, cols)), shape=(n, n)).tocsc()
        return whole[self.free][:, self.free]

    def mass(self, u):
        """Consistent mass in the deflected geometry, and of rigid plates at their nodes."""
        n = len(self.places)
        u3 = u.reshape(n, 3)
        i, j = self.ends[:, 0], self.ends[:, 1]
        d = self.places[j] + u3[j, :2] - self.places[i] - u3[i, :2]
        l = np.hypot(d[:, 0], d[:, 1])
        c, s = d[:, 0] / l, d[:, 1] / l
        L = self.length
        m = len(L)
        local = np.zeros((m, 6, 6))
        w = self.line * L
        local[:, [0, 3], [0, 3]] = (w / 3)[:, None]
        local[:, [0, 3], [3, 0]] = (w / 6)[:, None]
        bend = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
        at = [1, 2, 4, 5]
        lengths = np.stack([np.ones(m), L, np.ones(m), L], axis=1)
        b = w[:, None, None] * bend * lengths[:, :, None] * lengths[:, None, :]
        for p, P in enumerate(at):
            for q, Q in enumerate(at):
                local[:, P, Q] = b[:, p, q]
        T = np.zeros((m, 6, 6))
        for o in (0, 3):
            T[:, o, o], T[:, o, o + 1] = c, s
            T[:, o + 1, o], T[:, o + 1, o + 1] = -s, c
            T[:, o + 2, o + 2] = 1
        whole = self._assemble(np.einsum("mki,mkl,mlj->mij", T, local, T)).tolil()
        index = {dof: k for k, dof in enumerate(self.free)}
        for plate in self.scene.plates:
            m_p = self.scene.density * self.scene.h * plate.l * plate.w
            for axis, value in enumerate((m_p, m_p, m_p * (plate.l**2 + plate.w**2) / 12)):
                k = index.get(3 * plate.node + axis)
                if k is not None:
                    whole[k, k] += value
        return whole.tocsc()

    def newton(self, u, s=1.0, steps=40):
        """Newton from u; the equilibrium, or None. Also the largest step it took [m, or rotation times the mean length]."""
        u, most = u.copy(), 0.0
        last = np.inf
        for _ in range(steps):
            residual, K, _ = self.evaluate(u, s)
            try:
                step = -splu(K).solve(residual[self.free])
            except RuntimeError:
                return None, most
            size = self._size(step)
            if not np.isfinite(size) or size > 20 * self.scale:
                return None, most
            u[self.free] += step
            most = max(most, size)
            reach = max(self._size(u[self.free]), 1e-9 * self.scale)
            if size <= 1e-11 * reach or (size <= 1e-7 * reach and size > 0.1 * last):
                return u, most
            last = size
        return None, most

    def _size(self, step):
        weight = np.where(self.free % 3 == 2, self.scale, 1.0)
        return float(np.max(np.abs(step) * weight)) if len(step) else 0.0

    def stable(self, u, s=1.0):
        """Whether the stiffness at u is positive definite."""
        weight = diags(np.where(self.free % 3 == 2, 1 / self.scale, 1.0))
        try:
            # pivots on the diagonal alone: by Sylvester's law of inertia as many negative ones as negative eigenvalues
            factor = splu((weight @ self.evaluate(u, s)[1] @ weight).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:
            return False
        return bool(np.all(factor.perm_r == factor.perm_c) and np.all(factor.U.diagonal() > 0))

    def follow(self, first=1.0, smallest=2e-3):
        """The stable path from rest: (displacements, fraction reached). It ends where stability is lost within `smallest` of the present load."""
        u, s, ds = np.zeros(3 * len(self.places)), 0.0, first
        slope = None
        while s < 1.0:
            to = min(1.0, s + ds)
            guess = u if slope is None else u + slope * (to - s)
            new, _ = self.newton(guess, to, 15)
            ok = new is not None and self.stable(new, to)
            if ok and slope is not None:
                # a correction beyond half of the prediction has found another branch
                ok = self._size((new - guess)[self.free]) <= 0.5 * self._size((guess - u)[self.free]) + 1e-3 * self.scale
            if ok:
                u, s, ds = new, to, 2 * ds
                slope = self._slope(u, s)
            elif ds <= smallest * max(s, 1e-6):
                return u, s
            else:
                ds /= 2
                if slope is None:
                    slope = self._slope(u, s)
        return u, s

    def _slope(self, u, s):
        _, K, _ = self.evaluate(u, s)
        rate = np.zeros(len(u))
        step = 1e-6
        change = (self.evaluate(u, s + step)[0] - self.evaluate(u, s)[0]) / step
        rate[self.free] = -splu(K).solve(change[self.free])
        return rate

    def near(self, nodes):
        """The equilibrium next to the displacements `nodes` [n x 3] of the drawn nodes, or None. Springs hold the drawn nodes there, while
        what lies between them relaxes, and are weakened until they are gone."""
        u = self._between(nodes)
        target = u.copy()
        held = self.free < 3 * len(self.scene.places)
        weight = np.where(self.free % 3 == 2, self.scale**2, 1.0) * held * np.median(self.ea / self.length)
        for power in [1, -1, -3, -5, -7, None]:
            hold = weight * (0.0 if power is None else 10.0**power)
            u, ok = self._descend(u, target, hold)
            if not ok and power is None:
                return None
        return u

    def refined(self, coarse, u):
        """The displacements u of a frame with half as many elements on this one, at equilibrium; None without one."""
        mine = np.zeros((len(self.places), 3))
        other = u.reshape(-1, 3)
        n = len(self.scene.places)
        mine[:n] = other[:n]
        for fine, chain in zip(self.inner, coarse.inner):
            for k, (a, b) in enumerate(zip(chain, chain[1:])):
                mine[fine[2 * k]], mine[fine[2 * k + 2]] = other[a], other[b]
                pa, pb = coarse.places[a] + other[a, :2], coarse.places[b] + other[b, :2]
                chord = pb - pa
                old = coarse.places[b] - coarse.places[a]
                turn = np.arctan2(chord[1], chord[0]) - np.arctan2(old[1], old[0])
                mean = 0.5 * (other[a, 2] + other[b, 2])
                turn += 2 * np.pi * np.round((mean - turn) / (2 * np.pi))
                t1, t2 = other[a, 2] - turn, other[b, 2] - turn
                middle = 0.5 * (pa + pb) + np.array([-chord[1], chord[0]]) * (t1 - t2) / 8
                mine[fine[2 * k + 1], :2] = middle - self.places[fine[2 * k + 1]]
                mine[fine[2 * k + 1], 2] = turn - (t1 + t2) / 4
        u, ok = self._descend(mine.ravel(), mine.ravel(), np.zeros(len(self.free)))
        return u if ok else None

    def _descend(self, u, target, hold, steps=200):
        """Minimizes the energy with springs `hold` to `target` by damped Newton steps of at most a twentieth of a beam."""
        u, mu = u.copy(), 0.0
        weight = np.where(self.free % 3 == 2, self.scale**2, 1.0) * np.median(self.ei / self.length**3)
        away = lambda v: (v - target)[self.free]
        total = lambda v: self.energy(v) + 0.5 * float(hold @ away(v) ** 2)
        height = total(u)
        for _ in range(steps):
            residual, K, _ = self.evaluate(u)
            force = residual[self.free] + hold * away(u)
            while True:
                step = -splu((K + diags(hold + mu * weight)).tocsc()).solve(force)
                size = self._size(step)
                reach = max(self._size(u[self.free]), 1e-9 * self.scale)
                if mu == 0.0 and size <= 1e-9 * reach:
                    u[self.free] += step
                    return u, True
                trial = u.copy()
                trial[self.free] += step
                new = total(trial)
                if size <= 1e-6 * reach or (size <= 0.3 * self.scale and step @ force < 0 and new < height):
                    break
                mu = max(4 * mu, 1e-4)
                if mu > 1e12:
                    return u, False
            u, height = trial, new
            mu = mu / 8 if mu > 1e-4 else 0.0
        return u, False

    def _between(self, nodes):
        """Displacements with cubic shapes between the drawn nodes."""
        u = np.zeros((len(self.places), 3))
        u[: len(nodes)] = nodes
        for chain in self.inner:
            a, b = chain[0], chain[-1]
            pa, pb = self.places[a] + u[a, :2], self.places[b] + u[b, :2]
            chord, old = pb - pa, self.places[b] - self.places[a]
            turn = np.arctan2(chord[1], chord[0]) - np.arctan2(old[1], old[0])
            mean = 0.5 * (u[a, 2] + u[b, 2])
            turn += 2 * np.pi * np.round((mean - turn) / (2 * np.pi))
            t1, t2, l = u[a, 2] - turn, u[b, 2] - turn, np.hypot(*chord)
            normal = np.array([-chord[1], chord[0]]) / l
            for k, node in enumerate(chain[1:-1], 1):
                x = k / (len(chain) - 1)
                bow = l * (t1 * x * (1 - x) ** 2 - t2 * x**2 * (1 - x))
                u[node, :2] = pa + chord * x + normal * bow - self.places[node]
                u[node, 2] = turn + t1 * (1 - 4 * x + 3 * x**2) + t2 * (3 * x**2 - 2 * x)
        return u.ravel()

    def frequencies(self, u, count, s=1.0):
        """The lowest natural frequencies [Hz] about u."""
        weight = diags(np.where(self.free % 3 == 2, 1 / self.scale, 1.0))
        K, M = (weight @ matrix @ weight for matrix in (self.evaluate(u, s)[1], self.mass(u)))
        n = len(self.free)
        if n > 4 * count + 100:
            values = np.sort(eigsh(K.tocsc(), count, M.tocsc(), sigma=0.0, v0=np.ones(n), return_eigenvectors=False))
        else:
            values = linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=[0, min(count, n) - 1])
        return np.sqrt(np.maximum(values, 0)) / (2 * np.pi)

    def modes_at_rest(self):
        """Angular frequencies [rad/s] and mass-normalized shapes of the drawn geometry."""
        u = np.zeros(3 * len(self.places))
        K, M = self.evaluate(u, 0.0)[1].toarray(), self.mass(u).toarray()
        weight = np.where(self.free % 3 == 2, 1 / self.scale, 1.0)
        both = weight[:, None] * weight[None, :]
        values, shapes = linalg.eigh(K * both, M * both)
        return np.sqrt(np.maximum(values, 0)), weight[:, None] * shapes, M

    def linear_release(self):
        """The static deflection under all loads by the stiffness at rest."""
        u = np.zeros(3 * len(self.places))
        residual, K, _ = self.evaluate(u, 1.0)
        _, at_rest, _ = self.evaluate(u, 0.0)
        u[self.free] = -splu(at_rest).solve(residual[self.free])
        return u
