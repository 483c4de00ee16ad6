"""What becomes of a layout."""

from __future__ import annotations

from dataclasses import dataclass, field

from .netlist import Netlist

LAYOUTS = frozenset({".cif", ".gds", ".gdsii", ".gds2", ".sf"})
"""Extensions of layout files."""


_NAMED = 5
"""Pieces that are told one by one."""


class LayoutWarning(UserWarning):
    """What a layout's conversion has to tell, where only its netlist was asked for."""


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

    def told(self) -> list[str]:
        """What there is to know before its numbers are believed, as sentences."""
        lost = [
            f"{piece.area_m2 * 1e12:.4g} µm² of layer {piece.layer} not understood at "
            f"{piece.box_m[0] * 1e6:.4g}, {piece.box_m[1] * 1e6:.4g} µm: {piece.why}"
            for piece in self.unrecognised[:_NAMED]
        ]
        if len(self.unrecognised) > _NAMED:
            lost.append(f"{self.unrecognised_m2 * 1e12:.4g} µm² not understood in all, in {len(self.unrecognised)} pieces")
        return [*lost, *self.notes]
