"""Polygons of mems-sketch as CIF, which every command reads.

mems-sketch, an open editor of parametric MEMS layouts, writes what a component evaluates to as a geometry document: layers with polygons in
micrometres, in JSON or YAML. :func:`cif` makes CIF of it::

    from pathlib import Path
    from bimorph import geometry
    Path("top.cif").write_text(geometry.cif("top.json"))
    model = client.compile(client.convert("top.cif", process="mine.toml").netlist)

A layer ``gds: [1, 0]`` is ``1/0`` in the process file.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .arguments import wrong, wrong_type

FORMAT = "mems-sketch-geometry/1"
"""Value of the field ``format``."""

_NANOMETRES = 1000
"""Nanometres in a micrometre: the grid of the CIF file."""
_FARTHEST = 2**30
"""Largest coordinate on the grid."""


def cif(document: Mapping[str, Any] | str | os.PathLike[str]) -> str:
    """CIF of a geometry document, on a grid of 1 nm.

    ``document`` is the parsed document, or the path of a JSON file. YAML is parsed by the caller: ``cif(yaml.safe_load(text))``. Holes are joined to their
    hull by slits of width zero. An error names the layer and polygon.
    """
    read = _read(document)
    component = str(read.get("component") or "top")
    name = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in component)
    lines = ["DS 1 1 10;", f"9 {name};"]
    layers = read.get("layers")
    if not isinstance(layers, Mapping) or not layers:
        raise wrong("layers", "layers by name", layers)
    for layer, content in layers.items():
        at = f"layers.{layer}"
        if not isinstance(content, Mapping):
            raise wrong(at, "an object with `gds` and `polygons`", content)
        lines.append(f"L {_layer(at, content.get('gds'))};")
        polygons = content.get("polygons", [])
        # one polygon may stand without its list, and one without holes as its points
        polygons = [polygons] if isinstance(polygons, Mapping) else polygons
        if not isinstance(polygons, Sequence) or isinstance(polygons, str):
            raise wrong(f"{at}.polygons", "a list of polygons", polygons)
        for k, polygon in enumerate(polygons):
            points = " ".join(f"{x} {y}" for x, y in _contour(f"{at}.polygons[{k}]", polygon))
            lines.append(f"P {points};")
    lines += ["DF;", "C 1;", "E", ""]
    return "\n".join(lines)


def _read(document: Any) -> Mapping[str, Any]:
    if isinstance(document, (str, os.PathLike)):
        try:
            document = json.loads(Path(document).read_text(encoding="utf-8"))
        except json.JSONDecodeError as error:
            raise wrong("document", f"JSON ({error})", str(document)) from None
    if not isinstance(document, Mapping):
        raise wrong_type("document", "a geometry document, or the path of its JSON file", document)
    for name, expected in (("format", FORMAT), ("unit", "um")):
        if document.get(name) != expected:
            raise wrong(name, repr(expected), document.get(name))
    return document


def _layer(at: str, gds: Any) -> str:
    # MATLAB writes a row of a matrix
    numbers = gds[0] if isinstance(gds, Sequence) and len(gds) == 1 else gds
    good = isinstance(numbers, Sequence) and len(numbers) == 2 and all(isinstance(n, (int, float)) and n == int(n) >= 0 for n in numbers)
    if not good:
        raise wrong(f"{at}.gds", "layer and datatype, two whole numbers", gds)
    return f"L{int(numbers[0])}D{int(numbers[1])}"


def _contour(at: str, polygon: Any) -> list[tuple[int, int]]:
    """One contour: the hull, and each hole against it, joined by a slit."""
    if not isinstance(polygon, Mapping):
        return _points(at, polygon)
    unknown = sorted(set(polygon) - {"hull", "holes"})
    if unknown:
        raise wrong(at, "an object with `hull` and `holes`", unknown[0])
    hull = _points(f"{at}.hull", polygon.get("hull"))
    sense = _area(hull)
    contour = list(hull)
    for k, hole in enumerate(polygon.get("holes") or []):
        inside = _points(f"{at}.holes[{k}]", hole)
        if _area(inside) * sense > 0:
            inside.reverse()
        contour += [hull[0], *inside, inside[0], hull[0]]
    return contour


def _points(at: str, rows: Any) -> list[tuple[int, int]]:
    expected = "at least three rows of x and y in um"
    if not isinstance(rows, Sequence) or isinstance(rows, str) or len(rows) < 3:
        raise wrong(at, expected, rows)
    points = []
    for row in rows:
        if not isinstance(row, Sequence) or len(row) != 2 or not all(isinstance(x, (int, float)) and math.isfinite(x) for x in row):
            raise wrong(at, expected, row)
        points.append((round(row[0] * _NANOMETRES), round(row[1] * _NANOMETRES)))
    if any(abs(x) >= _FARTHEST for point in points for x in point):
        raise wrong(at, f"coordinates within {_FARTHEST // _NANOMETRES} um", "a point beyond")
    if _area(points) == 0:
        raise wrong(at, "a polygon with an area", "none")
    return points


def _area(points: Sequence[tuple[int, int]]) -> int:
    """Twice the area, positive against the clock."""
    pairs = zip(points, [*points[1:], points[0]], strict=True)
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in pairs)
