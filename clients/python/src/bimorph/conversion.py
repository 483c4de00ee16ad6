"""Results of the conversion of a layout."""

from __future__ import annotations

from dataclasses import dataclass, field

from .netlist import Netlist

LAYOUTS = frozenset({".cif", ".gds", ".gdsii", ".gds2", ".sf"})
"""Extensions of layout files."""


_NAMED = 5
"""Most unrecognised pieces that are listed one by one."""


class LayoutWarning(UserWarning):
    """Remarks of the conversion of a layout that was compiled directly."""


@dataclass(frozen=True)
class Piece:
    """A piece of a layout that is in no part of the mechanism."""

    layer: str
    area_m2: float
    """Area [m²]."""
    box_m: tuple[float, float, float, float]
    """Left, bottom, right and top of its bounding box [m]."""
    why: str


@dataclass(frozen=True)
class Conversion:
    """The netlist of a layout, and the areas that were not recognised."""

    netlist: Netlist
    """Netlist for ``compile``."""
    process: str
    """Name of the process that defined the layers."""
    by: str
    """How it was read: ``labels`` or ``geometry``."""
    drawn_m2: float
    """Area of the layers that move, as drawn [m²]."""
    extracted_m2: float
    """Part of that area in the mechanism [m²]."""
    anchored_m2: float
    """Part of that area in anchors [m²]."""
    unrecognised_m2: float
    """Part of that area in neither [m²]."""
    unrecognised: tuple[Piece, ...] = field(repr=False)
    """Pieces of that area."""
    notes: tuple[str, ...] = ()
    """Approximations and omissions, as sentences."""

    def remarks(self) -> list[str]:
        """Remarks about unrecognised areas, approximations and omissions, as sentences."""
        lost = [
            f"{piece.area_m2 * 1e12:.4g} µm² of layer {piece.layer} not understood at "
            f"{piece.box_m[0] * 1e6:.4g}, {piece.box_m[1] * 1e6:.4g} µm: {piece.why}"
            for piece in self.unrecognised[:_NAMED]
        ]
        if len(self.unrecognised) > _NAMED:
            lost.append(f"{self.unrecognised_m2 * 1e12:.4g} µm² not understood in all, in {len(self.unrecognised)} pieces")
        return [*lost, *self.notes]
