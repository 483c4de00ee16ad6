"""What becomes of a layout."""

from __future__ import annotations

from dataclasses import dataclass, field

from .netlist import Netlist

LAYOUTS = frozenset({".cif", ".gds", ".gdsii", ".gds2", ".sf"})
"""Extensions of layout files."""


@dataclass(frozen=True)
class Piece:
    """A piece of a drawing that is in no part of the mechanism."""

    layer: str
    area_m2: float
    """[m²]"""
    box_m: tuple[float, float, float, float]
    """Left, bottom, right and top [m]."""
    why: str


@dataclass(frozen=True)
class Conversion:
    """The netlist of a layout, and what was not understood."""

    netlist: Netlist
    """To compile."""
    process: str
    """Name of the process that said what the layers are."""
    by: str
    """How it was read: ``labels`` or ``geometry``."""
    drawn_m2: float
    """Area of the layers that move, as drawn [m²]."""
    extracted_m2: float
    """Of that, in the mechanism [m²]."""
    anchored_m2: float
    """Held by anchors [m²]."""
    unrecognised_m2: float
    """In neither [m²]."""
    unrecognised: tuple[Piece, ...] = field(repr=False)
    """The pieces of that."""
    notes: tuple[str, ...] = ()
    """What was approximated or left out, in words."""
