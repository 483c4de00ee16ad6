"""Plane stress on triangles with six nodes: stiffness, edge loads, flexibility of a piece under loads in balance.

E = 1 and thickness 1 throughout; lengths are in any unit. The triangles come from Shewchuk's Triangle.
"""

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg as solvers
import triangle

POINTS = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])
GAUSS = ((-np.sqrt(0.6), 5 / 9), (0.0, 8 / 9), (np.sqrt(0.6), 5 / 9))


def mesh(outline, size, fine, corners):
    """Triangles inside `outline` (points in order); `size` far from the `corners`, `fine` at them."""
    points = []
    count = len(outline)
    for k in range(count):
        a, b = np.asarray(outline[k]), np.asarray(outline[(k + 1) % count])
        length = np.linalg.norm(b - a)
        # steps grow with the distance from the nearest corner, from both ends, so that both may be fine
        marks = [0.0, *marks_from(a, b, length, size, fine, corners)]
        back = [length - m for m in marks_from(b, a, length, size, fine, corners)]
        middle = 0.5 * length
        marks = [m for m in marks if m <= middle] + sorted(m for m in back if middle + 0.3 * fine < m < length - 1e-12)
        points.extend(a + (b - a) * (m / length) for m in marks)
    points = np.array(points)
    n = len(points)
    segments = np.array([[k, (k + 1) % n] for k in range(n)])
    found = triangle.triangulate({"vertices": points, "segments": segments}, f"pq31a{0.6 * size * size:.10f}o2")
    return found["vertices"], found["triangles"]


def marks_from(a, b, length, size, fine, corners):
    """Distances from `a` of the points of an edge a–b, without its ends."""
    marks, at = [], 0.0
    while True:
        here = a + (b - a) * (at / length)
        distance = min((np.linalg.norm(here - c) for c in corners), default=1e9)
        at += min(size, fine + 0.25 * distance)
        if at >= length:
            return marks
        marks.append(at)


def gradients(l):
    """Derivatives of the six shape functions by the area coordinates L1, L2, L3 (rows), at one point."""
    l1, l2, l3 = l
    # Triangle's order: three vertices, then the nodes opposite to them
    return np.array(
        [
            [4 * l1 - 1, 0, 0, 0, 4 * l3, 4 * l2],
            [0, 4 * l2 - 1, 0, 4 * l3, 0, 4 * l1],
            [0, 0, 4 * l3 - 1, 4 * l2, 4 * l1, 0],
        ]
    )


def stiffness(vertices, triangles, poisson):
    """The stiffness matrix, unknowns (x, y) of each node in turn."""
    d = np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]]) / (1 - poisson**2)
    corner = vertices[triangles[:, :3]]
    x, y = corner[:, :, 0], corner[:, :, 1]
    double = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    dldx = np.stack([y[:, 1] - y[:, 2], y[:, 2] - y[:, 0], y[:, 0] - y[:, 1]], 1) / double[:, None]
    dldy = np.stack([x[:, 2] - x[:, 1], x[:, 0] - x[:, 2], x[:, 1] - x[:, 0]], 1) / double[:, None]
    local = np.zeros((len(triangles), 12, 12))
    for l in POINTS:
        g = gradients(l)
        nx, ny = dldx @ g, dldy @ g
        b = np.zeros((len(triangles), 3, 12))
        b[:, 0, 0::2] = nx
        b[:, 1, 1::2] = ny
        b[:, 2, 0::2] = ny
        b[:, 2, 1::2] = nx
        local += np.einsum("eki,kl,elj->eij", b, d, b, optimize=True) * (np.abs(double) / 6)[:, None, None]
    unknowns = np.stack([2 * triangles, 2 * triangles + 1], 2).reshape(len(triangles), 12)
    rows = np.repeat(unknowns, 12, 1).ravel()
    columns = np.tile(unknowns, (1, 12)).ravel()
    size = 2 * len(vertices)
    return sparse.csc_matrix((local.ravel(), (rows, columns)), shape=(size, size))


def face_loads(vertices, triangles, at, along, width):
    """Loads of a unit normal force, shear force and moment on the face through `at` with the outward normal `along`,
    distributed as in a long beam."""
    along = np.asarray(along)
    left = np.array([-along[1], along[0]])
    loads = np.zeros((2 * len(vertices), 3))
    relative = vertices - at
    on = (np.abs(relative @ along) < 1e-9) & (np.abs(relative @ left) < width / 2 + 1e-9)
    for i, j, k in ((0, 1, 5), (1, 2, 3), (2, 0, 4)):
        for edge in triangles[on[triangles[:, i]] & on[triangles[:, j]] & on[triangles[:, k]]][:, [i, j, k]]:
            y = relative[edge] @ left
            half = abs(y[1] - y[0]) / 2
            for t, weight in GAUSS:
                shape = np.array([t * (t - 1) / 2, t * (t + 1) / 2, 1 - t * t])
                eta = shape @ y
                normal = 1 / width
                shear = 1.5 / width * (1 - 4 * eta * eta / width**2)
                # a moment counterclockwise pulls where eta is negative
                bending = -12 * eta / width**3
                for column, traction in enumerate((normal * along, shear * left, bending * along)):
                    for node, share in zip(edge, shape):
                        loads[2 * node : 2 * node + 2, column] += weight * half * share * traction
    return loads


def flexibility(vertices, triangles, poisson, loads, fixed):
    """F with energy ½·a·F·a under the combination a of load columns, each in balance; `fixed` are held unknowns."""
    k = stiffness(vertices, triangles, poisson)
    free = np.setdiff1d(np.arange(k.shape[0]), fixed)
    solved = solvers.splu(k[free][:, free], permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(loads[free])
    return loads[free].T @ solved
