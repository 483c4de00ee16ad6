"""Options of a model. Written from crates/model/src/options/model.rs by ``BIMORPH_WRITE=1 cargo test --test options``."""

from __future__ import annotations

from typing import Literal, TypedDict


class Options(TypedDict, total=False):
    """Keywords of ``compile`` and ``sweep``; those left out, or None, have their defaults."""

    tol: float | None
    """Relative error aimed at. Smaller: more unknowns and shorter steps. Range: above 0, below 1; default: 1e-3."""

    band: float | None
    """Highest frequency the model must resolve: as many segments as the estimated error of every mode below it
    needs to stay within tol [Hz]. Range: above 0, at most 1e12; default: by what the analysis asks for."""

    junctions: Literal["centreline", "offset", "calibrated"] | None
    """How beams meet. centreline: in points, as in SUGAR; offset: at the edges of rigid junctions; calibrated:
    with springs there, from two-dimensional elasticity (docs/explanation/junctions.md). One of centreline,
    offset or calibrated; default: calibrated."""

    anchors: Literal["auto", "rigid", "elastic"] | None
    """How anchors hold beams. rigid: without any motion; elastic: a beam ends in the compliance of its root, a pad
    on a base of like stiffness; auto: elastic where the layer has an undercut, else rigid
    (docs/explanation/junctions.md). One of auto, rigid or elastic; default: auto."""

    fringe: Literal["auto", "none", "parallel", "exact", "sugar"] | None
    """Law of the fringe fields of all gaps, plates and combs, in place of those that the netlist names. none,
    parallel, exact or sugar (docs/reference/elements.md#fringe-fields-of-gaps); auto: as the netlist says, by
    default exact. One of auto, none, parallel, exact, sugar; default: auto."""

    linear: bool | None
    """Small displacements about the drawn geometry, as SUGAR."""

    undamped: bool | None
    """Leave out gas damping."""

    scheme: Literal["a0", "a2", "c1", "d1", "b", "e4", "es", "auto"] | None
    """How beams are cut into bodies and joints (docs/explanation/beams.md has their errors). auto: e4; es in joint
    coordinates, where every body needs rotary inertia. One of a0, a2, c1, d1, b, e4, es, auto; default: auto."""

    segments: int | None
    """Segments of every beam, whatever band and tol say. Range: 1 to 100000; default: by band and tol."""

    shear: bool | None
    """Shear flexibility of beams (Timoshenko, shear coefficient 5/6); SUGAR leaves it out."""

    rotary_inertia: bool | None
    """Rotary inertia of the sections of beams; SUGAR leaves it out."""

    imperfection: float | None
    """Imperfection: the structure is made in the shape of its lowest mode, the largest displacement being this
    share of the drawing's size; negative: to the other side. Lets what is compressed beyond buckling take a
    branch. Range: -0.1 to 0.1; default: none: as drawn."""

    other_branch: bool | None
    """At a bifurcation, where two sides are alike, take the other one: of the beams that bend most, the first of
    the netlist goes to the right of its drawn direction instead of the left."""

    as_sugar: bool | None
    """As SUGAR 2 computes, in one switch: linear, beams that meet in points (junctions=centreline), gaps between
    facing beams along the straight lines between their ends, beams in modes as stiff as drawn whatever they
    bear. `bimorph modes` takes one cubic element for each beam then."""

    without_circuit: bool | None
    """The mechanism without the circuit that is drawn around it (R, C, L, sources, amplifiers): its electrical
    nodes are ports by their names, for a deck that has the circuit."""

    formulation: Literal["auto", "compliant", "rcr", "rcr-elastic", "reduced"] | None
    """How bodies become equations. compliant: each body's own coordinates; rcr: joint coordinates on a tree, loops
    closed inside the recursion; rcr-elastic: the same, and beams' joints stay elastic with every method;
    reduced: few coordinates (static, tran, circuits); auto: what suits. One of auto, compliant, rcr,
    rcr-elastic, reduced; default: auto."""

    ranges: str | None
    """Ranges of what is given to ports (V, N, W), for which a reduced model is trained
    (docs/explanation/reduction.md). Without them tran trains for its own values, and circuits have the full
    model. In circuits auto takes the reduced model for them from a tol of 5e-3 on. Range: NAME:LOW:HIGH with
    LOW below HIGH, finite and once for each port, separated by commas (in decks by bars); default: none."""


WIRE = {
    "tol": "tol",
    "band": "band_hz",
    "junctions": "junctions",
    "anchors": "anchors",
    "fringe": "fringe",
    "linear": "linear",
    "undamped": "undamped",
    "scheme": "scheme",
    "segments": "segments",
    "shear": "shear",
    "rotary_inertia": "rotary_inertia",
    "imperfection": "imperfection",
    "other_branch": "other_branch",
    "as_sugar": "as_sugar",
    "without_circuit": "without_circuit",
    "formulation": "formulation",
    "ranges": "ranges",
}
"""Field on the wire of each option."""
