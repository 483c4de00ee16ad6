"""Solves the unit junctions and writes their springs to crates/model/src/discretize/junction_table.rs.

Run it by `scripts/junctions/calibrate`, which makes the virtual environment.
"""

import pathlib
import sys
import time

import numpy as np
import unit_junction

RATIOS = [2.0**k for k in (-3, -2, -1, -0.5, 0, 0.5, 1, 2, 3)]
TURNS = [0, 15, 30, 45, 60, 75, 90, 105, 120]
TILTS = [0, 15, 30, 45]
OUT = pathlib.Path(__file__).parents[2] / "crates/model/src/discretize/junction_table.rs"

# under a reflection about the branch, shear force and moment change sign, the normal force does not
MIRROR = np.array([1, -1, -1, 1, 1, 1])


def solved(*branches):
    """Springs and edges of a junction, branches given as (degrees, width)."""
    branches = [(np.radians(a), w) for a, w in branches]
    springs, error, effect = unit_junction.solve(branches)
    worst[0] = max(worst[0], (error, branches))
    return springs, unit_junction.offsets(branches)


worst = [(0.0, None)]


def row(edge, other, springs):
    return np.concatenate([[edge / other], springs])


def corners():
    """[ratio of the other's width to the own][turn], for the branch that has the other on its left."""
    table = {}
    for r, ratio in enumerate(RATIOS):
        if ratio < 1:
            continue
        for t, turn in enumerate(TURNS):
            # seen from the first, at 180°, the second, at -turn, lies counterclockwise
            springs, edge = solved((180, 1), (-turn, ratio))
            table[r, t] = row(edge[0], ratio, springs[0])
            opposite = row(edge[1], 1, springs[1] * MIRROR)
            table[len(RATIOS) - 1 - r, t] = (opposite + table[r, t]) / 2 if ratio == 1 else opposite
    # nothing changes where a beam continues: what the mesh leaves there is noise
    table[RATIOS.index(1), TURNS.index(0)] = np.zeros(7)
    return np.array([[table[r, t] for t in range(len(TURNS))] for r in range(len(RATIOS))])


def tees():
    """Stems [bar over stem][tilt to the right], and halves of bars [stem over bar][tilt of the stem towards it]."""
    stems, bars = {}, {}
    last_ratio, last_tilt = len(RATIOS) - 1, len(TILTS) - 1
    for r, ratio in enumerate(RATIOS):
        for t, tilt in enumerate(TILTS):
            springs, edge = solved((0, 1), (180, 1), (90 - tilt, ratio))
            stem = springs[2]
            near, far = springs[0], springs[1] * MIRROR
            if tilt == 0:
                near = far = (near + far) / 2
                stem = (stem + stem * MIRROR) / 2
            stems[last_ratio - r, t] = row(edge[2], 1, stem)
            bars[r, last_tilt + t] = row(edge[0], ratio, near)
            bars[r, last_tilt - t] = row(edge[1], ratio, far)
    return (
        np.array([[stems[r, t] for t in range(len(TILTS))] for r in range(len(RATIOS))]),
        np.array([[bars[r, t] for t in range(2 * last_tilt + 1)] for r in range(len(RATIOS))]),
    )


def crosses():
    """[other bar over own][tilt]: the other bar leans towards this branch on its left, away from it on its right."""
    table = {}
    for r, ratio in enumerate(RATIOS):
        if ratio < 1:
            continue
        for t, tilt in enumerate(TILTS):
            springs, edge = solved((0, 1), (180, 1), (90 - tilt, ratio), (270 - tilt, ratio))
            bar = (springs[0] + springs[1]) / 2
            stem = (springs[2] + springs[3]) / 2 * MIRROR
            if tilt == 0:
                bar, stem = (bar + bar * MIRROR) / 2, (stem + stem * MIRROR) / 2
            bar, stem = row(edge[0], ratio, bar), row(edge[2], 1, stem)
            if ratio == 1:
                bar = stem = (bar + stem) / 2
            table[r, t] = bar
            table[len(RATIOS) - 1 - r, t] = stem
    return np.array([[table[r, t] for t in range(len(TILTS))] for r in range(len(RATIOS))])


def text(values):
    """A nested array as Rust writes it, one row of numbers a line."""

    def one(x, indent):
        pad = " " * indent
        if np.ndim(x) == 1:
            return pad + "[" + ", ".join(f"{v + 0.0:.4f}".replace("-0.0000", "0.0000") for v in x) + "],\n"
        return pad + "[\n" + "".join(one(y, indent + 4) for y in x) + pad + "],\n"

    return "[\n" + "".join(one(x, 4) for x in values) + "]"


def main():
    start = time.time()
    clamp = unit_junction.clamp()
    corner = corners()
    stem, bar = tees()
    cross = crosses()
    radians = lambda degrees: "[" + ", ".join(f"{d:.1f}" for d in degrees) + "]"
    ratios = ", ".join(f"{np.log2(r):.1f}" for r in RATIOS)
    tilts = sorted({-t for t in TILTS} | set(TILTS))
    OUT.write_text(f"""//! Springs of junctions, from two-dimensional plane stress. Written by `scripts/junctions/calibrate`: do not edit.
//!
//! Source: plane stress with Poisson's ratio {unit_junction.POISSON}, triangles with six nodes, sixteen across the widest branch and finer by
//! a factor of up to 48 of the narrowest at re-entrant corners; loads are those of a long beam, on faces two widths away.
//! The beams' own compliance (bending, stretch, shear with κ = 5/6) between the edge of the junction and the faces is
//! taken away; what is left is shared among the branches by least squares over all loads in balance. What three numbers of
//! one branch cannot say (a cross bends more easily than it shears into a rhomb) stays as an error: at worst
//! {worst[0][0]:.3f} of the compliance of branches ten widths long.
//!
//! A row: the distance from the node to the edge of the junction over the other's width, then the spring there,
//! c_uu, c_ug, c_up, c_gg, c_gp, c_pp in the unit 1/(E·t), for strains (u, g, p·w) under (N, V, M/w), w the branch's width.

#![cfg_attr(rustfmt, rustfmt_skip)]
#![allow(clippy::approx_constant)]

/// Distance of the edge and six compliances.
pub type Row = [f64; 7];

/// log₂ of the other's width over the branch's own, of every table.
pub const RATIOS: [f64; {len(RATIOS)}] = [{ratios}];
/// Angle by which a corner leaves the straight line [°].
pub const TURNS: [f64; {len(TURNS)}] = {radians(TURNS)};
/// Lean of a stem or crossing bar from the perpendicular [°].
pub const TILTS: [f64; {len(TILTS)}] = {radians(TILTS)};
/// Lean of a stem towards the half of the bar [°].
pub const LEANS: [f64; {len(tilts)}] = {radians(tilts)};

/// A clamped end: the edge cannot contract across. Distance 0.
pub const CLAMP: Row = {"[" + ", ".join(f"{v + 0.0:.4f}" for v in [0.0, *clamp]).replace("-0.0000", "0.0000") + "]"};

/// Two branches, the other on the left: by ratio and turn.
pub const CORNER: [[Row; {len(TURNS)}]; {len(RATIOS)}] = {text(corner)};

/// The stem of a T, leaning to the right: by ratio of bar over stem and tilt.
pub const STEM: [[Row; {len(TILTS)}]; {len(RATIOS)}] = {text(stem)};

/// Half of the bar of a T, the stem on the left: by ratio of stem over bar and lean.
pub const BAR: [[Row; {len(tilts)}]; {len(RATIOS)}] = {text(bar)};

/// A branch of a cross whose other bar leans towards it on its left: by ratio of the other bar and tilt.
pub const CROSS: [[Row; {len(TILTS)}]; {len(RATIOS)}] = {text(cross)};
""")
    print(f"wrote {OUT} in {time.time() - start:.0f} s; largest error of a fit {worst[0][0]:.4f} at {worst[0][1]}", file=sys.stderr)


if __name__ == "__main__":
    main()
