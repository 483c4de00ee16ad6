"""One junction: its outline, where its branches leave it, and what its springs must be.

A branch is (angle from the node outwards, width). The drawing is the union of the beams' rectangles; where nothing continues
in line, a rectangle reaches past the node far enough to fill the outer corner. Compliances are in the unit 1/(E·t),
over a normal force N, a shear force V and a moment over width M/w, so that a rotation spring 12·a is a piece of beam a·w long.
"""

import numpy as np
from shapely.geometry import Point, Polygon
from shapely.ops import unary_union

import plane_stress

POISSON = 0.3
# shear area of a rectangle over its area
KAPPA = 5 / 6
# what a branch must differ from straight on to leave the outer corner to others
IN_LINE = np.radians(50)


def between(a, b):
    """The angle between two directions, 0 to pi."""
    return abs((b - a + np.pi) % (2 * np.pi) - np.pi)


def reaches(branches):
    """How far each rectangle goes past the node."""
    found = []
    for i, (angle, _) in enumerate(branches):
        others = [(between(angle, a), w) for k, (a, w) in enumerate(branches) if k != i]
        if not others or any(np.pi - turn < IN_LINE for turn, _ in others) and len(others) > 1:
            found.append(0.0)
            continue
        found.append(max(w / 2 * np.tan(min(np.pi - turn, 2.1) / 2) for turn, w in others))
    return found


def rectangle(angle, width, start, end):
    along, left = direction(angle)
    return Polygon([along * s + left * (width / 2 * t) for s, t in ((start, -1), (end, -1), (end, 1), (start, 1))])


def direction(angle):
    return np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])


def offsets(branches):
    """How far along each branch its edges lie inside the others."""
    past = reaches(branches)
    found = []
    for i, (angle, width) in enumerate(branches):
        along, left = direction(angle)
        far = 0.0
        for k, (other, wide) in enumerate(branches):
            if k == i:
                continue
            e, n = direction(other)
            for side in (-1, 1):
                # (s·along + side·w/2·left) within the other's rectangle: two linear conditions on s
                at = left * (side * width / 2)
                low, high = -np.inf, np.inf
                for slope, value, least, most in (
                    (along @ e, at @ e, -past[k], np.inf),
                    (along @ n, at @ n, -wide / 2, wide / 2),
                ):
                    if abs(slope) < 1e-9:
                        if value < least - 1e-9 * width or value > most + 1e-9 * width:
                            low, high = np.inf, -np.inf
                        continue
                    ends = sorted(((least - value) / slope, (most - value) / slope))
                    low, high = max(low, ends[0]), min(high, ends[1])
                if low < high and high > far and np.isfinite(high):
                    far = high
        found.append(far)
    return found


def solve(branches, across=16, stub=2.0, fine=48, ridge=2e-4):
    """Springs at the edge of the junction, one symmetric 3×3 matrix a branch, and the relative error of the fit."""
    edge = offsets(branches)
    cut = [o + stub * w for o, (_, w) in zip(edge, branches)]
    # rectangles overlap by the junction: cut all beyond the widest branch's reach
    past = reaches(branches)
    shape = unary_union(
        [rectangle(a, w, -p if p > 0 else 0.0, d).buffer(1e-9, join_style=2) for (a, w), p, d in zip(branches, past, cut)]
    )
    outline = Polygon(shape.exterior).simplify(1e-6)
    outline = np.array(outline.exterior.coords)[:-1]
    outline = settle(outline, branches, cut)
    narrow = min(w for _, w in branches)
    if not Polygon(outline).exterior.is_ccw:
        outline = outline[::-1]
    corners = reentrant(outline)
    vertices, triangles = plane_stress.mesh(outline, max(w for _, w in branches) / across, narrow / fine, corners)
    sets = [
        plane_stress.face_loads(vertices, triangles, direction(a)[0] * d, direction(a)[0], w)
        for (a, w), d in zip(branches, cut)
    ]
    # loads (N, V, M/w) at the node, carried to the cut
    count = len(branches)
    columns = np.zeros((len(vertices) * 2, 3 * count))
    balance = np.zeros((3, 3 * count))
    own = np.zeros((3 * count, 3 * count))
    reference = np.zeros((3 * count, 3 * count))
    for i, ((angle, width), d) in enumerate(zip(branches, cut)):
        to_cut = np.array([[1, 0, 0], [0, 1, 0], [0, -d, width]])
        columns[:, 3 * i : 3 * i + 3] = sets[i] @ to_cut
        along, left = direction(angle)
        balance[:2, 3 * i], balance[:2, 3 * i + 1], balance[2, 3 * i + 2] = along, left, width
        own[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = beam(width, edge[i], d)
        reference[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = beam(width, 0, 10 * width)
    basis = np.linalg.svd(balance)[2][3:].T
    total = plane_stress.flexibility(vertices, triangles, POISSON, columns @ basis, held(vertices))
    measure = np.linalg.inv(np.linalg.cholesky(basis.T @ reference @ basis))
    target = measure @ (total - basis.T @ own @ basis) @ measure.T
    # least squares over six numbers a branch, a little pull towards none
    pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    rows, effects = np.triu_indices(len(target)), []
    for i, (_, width) in enumerate(branches):
        shift = np.array([[1, 0, 0], [0, 1, 0], [0, -edge[i] / width, 1]])
        for r, c in pairs:
            unit = np.zeros((3, 3))
            unit[r, c] = unit[c, r] = 1
            effect = np.zeros_like(own)
            effect[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = shift.T @ unit @ shift
            effects.append((measure @ basis.T @ effect @ basis @ measure.T)[rows])
    effects = np.array(effects).T
    pull = ridge * np.eye(effects.shape[1])
    numbers = np.linalg.lstsq(np.vstack([effects, pull]), np.concatenate([target[rows], np.zeros(len(pull))]), rcond=None)[0]
    error = np.linalg.norm(effects @ numbers - target[rows])
    return numbers.reshape(count, 6), error, np.linalg.norm(target)


def beam(width, start, end):
    """Compliance of a straight piece from `start` to `end` under (N, V, M/w) at the node."""
    ei, shear = width**3 / 12, KAPPA * width / (2 * (1 + POISSON))
    length, first, second = end - start, (end**2 - start**2) / 2, (end**3 - start**3) / 3
    return np.array(
        [
            [length / width, 0, 0],
            [0, second / ei + length / shear, -first * width / ei],
            [0, -first * width / ei, length * width**2 / ei],
        ]
    )


def settle(outline, branches, cut):
    """Puts the points of the cut faces where they belong exactly."""
    settled = outline.copy()
    for (angle, width), d in zip(branches, cut):
        along, left = direction(angle)
        for side in (-1, 1):
            point = along * d + left * (side * width / 2)
            nearest = np.argmin(np.linalg.norm(settled - point, axis=1))
            if np.linalg.norm(settled[nearest] - point) > 1e-3 * width:
                raise ValueError(f"a cut face at {np.degrees(angle):.0f} degrees is hidden by another branch")
            settled[nearest] = point
    return settled


def reentrant(outline):
    """Corners at which the outline turns inwards."""
    found = []
    for k in range(len(outline)):
        a, b, c = outline[k - 1], outline[k], outline[(k + 1) % len(outline)]
        if np.cross(b - a, c - b) < -1e-6:
            found.append(b)
    return found


def held(vertices):
    """Three unknowns that hold a piece without straining it: both of one node, one of another."""
    first = np.argmin(np.linalg.norm(vertices, axis=1))
    far = np.argmax(np.abs(vertices[:, 0] - vertices[first, 0]))
    return [2 * first, 2 * first + 1, 2 * far + 1]


def clamp(across=16):
    """Springs of the end of a beam whose edge is held rigidly."""
    length, width = 3.0, 1.0
    outline = np.array([[0, -0.5], [length, -0.5], [length, 0.5], [0, 0.5]])
    vertices, triangles = plane_stress.mesh(outline, 1 / across, 1 / 48, [outline[0], outline[3]])
    loads = plane_stress.face_loads(vertices, triangles, np.array([length, 0]), np.array([1.0, 0.0]), width)
    loads = loads @ np.array([[1, 0, 0], [0, 1, 0], [0, -length, width]])
    on = np.flatnonzero(np.abs(vertices[:, 0]) < 1e-9)
    total = plane_stress.flexibility(vertices, triangles, POISSON, loads, np.concatenate([2 * on, 2 * on + 1]))
    c = total - beam(width, 0, length)
    return np.array([c[0, 0], c[0, 1], c[0, 2], c[1, 1], c[1, 2], c[2, 2]])
