"""Six layouts, each drawn once: as a netlist, and as quadrilaterals with eight nodes for CalculiX.

A layout is a list of straight beams between named points, and the points that are clamped. All of it is drawn along x and
y; the chevron's legs are then sheared, |x| moving y. Lengths in µm.
"""

import numpy as np
import unit_junction

E, POISSON, DENSITY, THICKNESS = 165e9, 0.3, 2300.0, 2.0


class Layout:
    """Points, beams (from, to, width), clamped points, and the slope of the legs outside of |x| = `flat`."""

    def __init__(self, title, points, beams, clamped, slope=0.0, flat=0.0):
        self.title, self.points, self.beams, self.clamped = title, points, beams, clamped
        self.slope, self.flat = slope, flat

    def drawn(self, name):
        """Where a point lies in the netlist: the legs' centrelines meet on the axis of the shuttle."""
        x, y = self.points[name]
        return np.array([x, y - self.slope * abs(x)])

    def netlist(self):
        lines = [
            f"% {self.title}. Written by scripts/junctions/validate, which solves the same drawing in two dimensions.",
            f"process p1 = [ Youngsmodulus={E:g} Poisson={POISSON} density={DENSITY:g} h={THICKNESS:g}u ]",
        ]
        for name in self.clamped:
            lines.append(f"anchor p1 [{name}] [l=10u w=10u]")
        for a, b, width in self.beams:
            away = self.drawn(b) - self.drawn(a)
            # a leg's width is measured across its drawn direction
            width = width * np.cos(np.arctan(self.slope)) if self.sloped(a, b) else width
            lines.append(
                f"beam2d p1 [{a} {b}] [l={np.hypot(*away):.9g}u w={width:.9g}u oz={np.arctan2(away[1], away[0]):.12g}]"
            )
        return "\n".join(lines) + "\n"

    def sloped(self, a, b):
        return self.slope != 0 and self.points[a][1] == self.points[b][1]

    def rectangles(self):
        """(x0, x1, y0, y1) of every beam, outer corners filled."""
        found = []
        at = {name: [] for name in self.points}
        for k, (a, b, width) in enumerate(self.beams):
            away = np.subtract(self.points[b], self.points[a])
            angle = np.arctan2(away[1], away[0])
            at[a].append((k, 0, angle, width))
            at[b].append((k, 1, angle + np.pi, width))
        past = np.zeros((len(self.beams), 2))
        for name, meeting in at.items():
            if len(meeting) > 1 and name not in self.clamped:
                for (k, end, _, _), reach in zip(meeting, unit_junction.reaches([(m[2], m[3]) for m in meeting])):
                    past[k, end] = reach
        for k, (a, b, width) in enumerate(self.beams):
            p, q = np.array(self.points[a], float), np.array(self.points[b], float)
            along = (q - p) / np.linalg.norm(q - p)
            p, q = p - along * past[k, 0], q + along * past[k, 1]
            across = np.abs(along[::-1]) * width / 2
            low, high = np.minimum(p, q) - across, np.maximum(p, q) + across
            found.append((low[0], high[0], low[1], high[1]))
        return found

    def mesh(self, across=6):
        """Nodes [µm], elements of eight nodes (0-based), clamped nodes: `across` elements over the narrowest beam."""
        boxes = self.rectangles()
        narrow = min(width for _, _, width in self.beams)
        xs = marks([x for box in boxes for x in box[:2]], narrow, across)
        ys = marks([y for box in boxes for y in box[2:]], narrow, across)
        inside = np.zeros((len(xs) - 1, len(ys) - 1), bool)
        mx, my = (xs[1:] + xs[:-1]) / 2, (ys[1:] + ys[:-1]) / 2
        for x0, x1, y0, y1 in boxes:
            inside |= np.outer((mx > x0) & (mx < x1), (my > y0) & (my < y1))
        number, nodes, elements = {}, [], []

        def node(i, j):
            # half steps: even is a corner, odd a middle
            if (i, j) not in number:
                number[i, j] = len(nodes)
                x = xs[i // 2] if i % 2 == 0 else mx[i // 2]
                y = ys[j // 2] if j % 2 == 0 else my[j // 2]
                nodes.append((x, y))
            return number[i, j]

        ring = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
        for i, j in np.argwhere(inside):
            elements.append([node(2 * i + a, 2 * j + b) for a, b in ring])
        nodes = np.array(nodes)
        held = np.zeros(len(nodes), bool)
        for name in self.clamped:
            p = np.array(self.points[name], float)
            for k, (a, b, width) in enumerate(self.beams):
                if name in (a, b):
                    other = np.array(self.points[b if name == a else a], float)
                    along = (other - p) / np.linalg.norm(other - p)
                    relative = nodes - p
                    left = np.array([-along[1], along[0]])
                    held |= (np.abs(relative @ along) < 1e-6) & (np.abs(relative @ left) < width / 2 + 1e-6)
        if self.slope:
            nodes[:, 1] -= self.slope * np.maximum(np.abs(nodes[:, 0]), self.flat)
        return nodes, np.array(elements), np.flatnonzero(held)


def marks(edges, narrow, across):
    """Grid lines through the edges; fine next to them, coarser in between."""
    edges = np.unique(np.round(edges, 9))
    found = [edges[0]]
    for a, b in zip(edges, edges[1:]):
        length = b - a
        fine, coarse = narrow / across, narrow
        steps, total, size = [], 0.0, fine
        while 2 * total < length:
            steps.append(size)
            total += size
            size = min(size * 1.4, coarse)
        steps = np.array(steps + steps[::-1])
        at = np.cumsum(steps) * (length / steps.sum())
        found.extend(a + at[:-1])
        found.append(b)
    return np.array(found)


def heatuator():
    points = {"p": (0, 0), "t": (220, 0), "c": (220, -11.5), "f": (60, -11.5), "g": (0, -11.5)}
    beams = [("p", "t", 2.5), ("t", "c", 6), ("c", "f", 14), ("f", "g", 2.5)]
    return Layout("Thermal actuator of one hot and one cold arm", points, beams, ["p", "g"])


def bank():
    points, beams, clamped = {}, [], []
    for k, tip in enumerate(("low", "yoke", "high")):
        y = 49.5 * k
        names = [f"{n}{k + 1}" for n in "atcfg"]
        for name, at in zip(names, ((0, y), (206, y), (206, y - 23), (94, y - 23), (0, y - 23))):
            points[name] = at
        a, t, c, f, g = names
        points[tip] = (230, y - 23)
        beams += [(a, t, 2), (t, c, 13), (c, f, 8), (f, g, 1.9), (c, tip, 3)]
        clamped += [a, g]
    beams += [("low", "yoke", 11), ("yoke", "high", 11)]
    return Layout("Three thermal bimorphs that push one yoke", points, beams, clamped)


def folded_flexure():
    # a shuttle along x, on either side of it a truss on four beams: two to ground, two to the shuttle
    points = {"l": (-60, 0), "r": (60, 0), "m": (0, 0), "il": (-30, 0), "ir": (30, 0)}
    beams = [("l", "il", 16), ("il", "m", 16), ("m", "ir", 16), ("ir", "r", 16)]
    clamped = []
    for side, s in (("u", 1), ("d", -1)):
        far = 150 * s
        for name, x in (("l", -60), ("il", -30), ("ir", 30), ("r", 60)):
            points[name + side] = (x, far)
        beams += [("l" + side, "il" + side, 6), ("il" + side, "ir" + side, 6), ("ir" + side, "r" + side, 6)]
        beams += [("l", "l" + side, 3), ("r", "r" + side, 3)]
        for name, x in (("il", -30), ("ir", 30)):
            anchor = name + side + "0"
            points[anchor] = (x, 20 * s)
            beams.append((anchor, name + side, 3))
            clamped.append(anchor)
    return Layout("Shuttle on folded flexures", points, beams, clamped)


def serpentine():
    points, beams = {"n0": (0, 0)}, []
    at, last = np.array([0.0, 0.0]), "n0"
    # out and back and out, four times, turns wider than the runs
    moves = []
    for k in range(4):
        moves += [((0, 60 if k % 2 == 0 else -60), 3), ((14, 0), 5)]
    moves += [((0, 30), 3), ((40, 0), 10)]
    for k, (move, width) in enumerate(moves):
        at = at + move
        name = f"n{k + 1}"
        points[name] = tuple(at)
        beams.append((last, name, width))
        last = name
    return Layout("Meander of narrow runs and wide turns with a wide end", points, beams, ["n0"])


def chevron():
    points, beams, clamped = {}, [], []
    names = ["s0", "s1", "s2", "s3", "s4"]
    for name, y in zip(names, (-25, 0, 20, 40, 60)):
        points[name] = (0, y)
    beams += [(a, b, 12) for a, b in zip(names, names[1:])]
    points["head"] = (0, 85)
    beams.append(("s4", "head", 24))
    for name in ("s1", "s2", "s3"):
        for side, x in (("l", -150), ("r", 150)):
            points[name + side] = (x, points[name][1])
            beams.append((name + side, name, 4))
            clamped.append(name + side)
    return Layout("Chevron of three pairs of legs at five degrees", points, beams, clamped, np.tan(np.radians(5)), 6.0)


def paddle():
    # widths of one to thirty: beyond the table of steps; the block's sections turn with what is between the threads
    points = {"a": (0, 0), "b": (60, 0), "c": (180, 0), "d": (240, 0)}
    return Layout("Wide block between two threads", points, [("a", "b", 2), ("b", "c", 60), ("c", "d", 2)], ["a"])


ALL = {f.__name__: f for f in (heatuator, bank, folded_flexure, serpentine, chevron, paddle)}
