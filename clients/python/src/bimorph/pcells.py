"""The cells of :mod:`bimorph.layout` as gdsfactory cells: outlines on masks, and ports at the nodes.

This module requires gdsfactory; the package itself does not. Lengths are in micrometres, times in microseconds::

    import gdsfactory as gf
    from bimorph import layout, pcells

    c = gf.Component()
    spring = c.add_ref(pcells.folded_flexure(length=150), name="spring")
    drive = c.add_ref(pcells.comb_drive(fingers=6), name="drive")
    drive.connect("a", spring["right"])
    pad = c.add_ref(pcells.anchor_pad(width=20), name="pad")
    pad.connect("a", drive["b"])
    model = client.compile(layout.from_gdsfactory(c).netlist())

:data:`CELLS` goes into a PDK (``gf.Pdk(cells=pcells.CELLS)``). The outlines are those of ``bimorph layout`` for the same subnets. A port
represents a point and always has a width of 1 µm, so that any two can be connected.
"""

from __future__ import annotations

import math
from collections.abc import Callable

try:
    import gdsfactory as gf
except ImportError as missing:
    raise ImportError("bimorph.pcells draws gdsfactory components: install gdsfactory to use it") from missing

LAYER = (45, 0)
"""Movable layer: POLY1 of the shipped process ``polymumps``."""
ANCHOR = (43, 0)
"""Anchor layer: ANCHOR1 of ``polymumps``."""

_PAD = 10.0
_INSET = 0.1
_PORT = 1.0

Layer = tuple[int, int]
Point = tuple[float, float]


class _Sheet:
    """Builder of outlines as in ``bimorph layout``. Lengths are in micrometres, directions in degrees."""

    def __init__(self, layer: Layer, anchor: Layer) -> None:
        self.component = gf.Component()
        self._layer, self._anchor = layer, anchor

    def bar(
        self, start: Point, degrees: float, length: float, width: float, *, past: Point = (0.0, 0.0), layer: Layer | None = None
    ) -> Point:
        """Draws a bar from ``start``, extended by ``past`` at both ends; returns its end without the extension."""
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        at = [(-past[0], -0.5), (length + past[1], -0.5), (length + past[1], 0.5), (-past[0], 0.5)]
        points = [(start[0] + a * c - b * width * s, start[1] + a * s + b * width * c) for a, b in at]
        self.component.add_polygon(points, layer=layer or self._layer)
        return (start[0] + length * c, start[1] + length * s)

    def pad(self, start: Point, degrees: float, length: float = _PAD, width: float = _PAD) -> None:
        """Draws an anchor pad ahead of ``start``."""
        inset = _INSET * min(length, width)
        self.bar(start, degrees, length, width)
        self.bar(start, degrees, length, width - 2 * inset, past=(-inset, -inset), layer=self._anchor)

    def port(self, name: str, at: Point, orientation: float) -> None:
        """Adds a port at a node."""
        self.component.add_port(name, center=at, width=_PORT, orientation=orientation, layer=self._layer, port_type="electrical")


@gf.cell
def anchor_pad(length: float = 10.0, width: float = 10.0, layer: Layer = LAYER, anchor: Layer = ANCHOR) -> gf.Component:
    """A pad that anchors its port ``a``."""
    sheet = _Sheet(layer, anchor)
    sheet.pad((0.0, 0.0), 0.0, length, width)
    sheet.port("a", (0.0, 0.0), 180)
    return sheet.component


@gf.cell
def plain_beam(length: float = 100.0, width: float = 2.0, layer: Layer = LAYER) -> gf.Component:
    """A straight beam from ``a`` to ``b``."""
    sheet = _Sheet(layer, layer)
    end = sheet.bar((0.0, 0.0), 0.0, length, width)
    sheet.port("a", (0.0, 0.0), 180)
    sheet.port("b", end, 0)
    return sheet.component


@gf.cell
def folded_flexure(
    length: float = 200.0,
    width: float = 2.0,
    pitch: float = 20.0,
    half: float = 40.0,
    foot: float = 40.0,
    truss: float = 10.0,
    layer: Layer = LAYER,
    anchor: Layer = ANCHOR,
) -> gf.Component:
    """A shuttle on a flexure folded over two trusses; it moves along x."""
    sheet = _Sheet(layer, anchor)
    sheet.bar((-half, 0.0), 0.0, 2 * half, 2 * foot)
    for up in (1, -1):
        for side in (1, -1):
            top = sheet.bar((side * half, up * foot), up * 90.0, length, width, past=(0.0, truss / 2))
            corner = sheet.bar(top, 0.0 if side > 0 else 180.0, pitch, truss, past=(width / 2, width / 2))
            pad = sheet.bar(corner, -up * 90.0, length, width, past=(truss / 2, 0.0))
            sheet.pad(pad, -up * 90.0)
        sheet.bar((-half, up * (foot + length)), 0.0, 2 * half, truss, past=(width / 2, width / 2))
    sheet.port("c", (0.0, 0.0), 0)
    sheet.port("left", (-half, 0.0), 180)
    sheet.port("right", (half, 0.0), 0)
    return sheet.component


@gf.cell
def comb_drive(
    fingers: int = 20,
    gap: float = 2.0,
    overlap: float = 20.0,
    length: float = 40.0,
    finger: float = 2.0,
    spine: float = 8.0,
    layer: Layer = LAYER,
) -> gf.Component:
    """A comb drive: ``fingers`` on the side of ``b`` between ``fingers + 1`` on the side of ``a``."""
    sheet = _Sheet(layer, layer)
    pitch = finger + gap
    tall = 2 * fingers * pitch + finger
    far = 2 * spine + 2 * length - overlap
    sheet.bar((0.0, 0.0), 0.0, spine, tall)
    sheet.bar((far, 0.0), 180.0, spine, tall)
    for k in range(2 * fingers + 1):
        y = (k - fingers) * pitch
        sheet.bar((spine, y) if k % 2 == 0 else (far - spine, y), 0.0 if k % 2 == 0 else 180.0, length, finger)
    sheet.port("a", (0.0, 0.0), 180)
    sheet.port("b", (far, 0.0), 0)
    return sheet.component


@gf.cell
def thermal_bimorph(
    length: float = 206.0,
    hot: float = 2.0,
    cold: float = 8.0,
    cold_length: float = 112.0,
    flexure: float = 1.9,
    spacing: float = 23.0,
    bar: float = 13.0,
    link: float = 24.0,
    tau: float = 230.0,
    layer: Layer = LAYER,
    anchor: Layer = ANCHOR,
) -> gf.Component:
    """A hot and a cold arm between the pads ``a`` and ``g``; its tip is linked to ``o``. ``tau`` [µs] does not affect the outline."""
    sheet = _Sheet(layer, anchor)
    sheet.pad((0.0, 0.0), 180.0)
    tip = sheet.bar((0.0, 0.0), 0.0, length, hot, past=(0.0, bar / 2))
    corner = sheet.bar(tip, -90.0, spacing, bar, past=(hot / 2, cold / 2))
    flex = sheet.bar(corner, 180.0, cold_length, cold, past=(bar / 2, 0.0))
    ground = sheet.bar(flex, 180.0, length - cold_length, flexure)
    sheet.pad(ground, 180.0)
    out = sheet.bar(corner, 0.0, link, 3.0, past=(bar / 2, 0.0))
    sheet.port("a", (0.0, 0.0), 180)
    sheet.port("g", ground, 180)
    sheet.port("o", out, 0)
    return sheet.component


@gf.cell
def serpentine(turns: int = 4, length: float = 100.0, pitch: float = 10.0, width: float = 2.0, layer: Layer = LAYER) -> gf.Component:
    """A meander along x with long beams along y, from ``a`` to ``b``; its ends close the corners to beams along x."""
    sheet = _Sheet(layer, layer)
    both = (width / 2, width / 2)
    at = sheet.bar((0.0, 0.0), 90.0, length / 2, width, past=both)
    for k in range(turns):
        at = sheet.bar(at, 0.0, pitch, width, past=both)
        at = sheet.bar(at, -90.0, length, width, past=both)
        at = sheet.bar(at, 0.0, pitch, width, past=both)
        at = sheet.bar(at, 90.0, length if k + 1 < turns else length / 2, width, past=both)
    sheet.port("a", (0.0, 0.0), 180)
    sheet.port("b", at, 0)
    return sheet.component


CELLS: dict[str, Callable[..., gf.Component]] = {
    cell.__name__: cell for cell in (anchor_pad, plain_beam, folded_flexure, comb_drive, thermal_bimorph, serpentine)
}
"""Cells by name, for a PDK."""
