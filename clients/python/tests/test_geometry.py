"""Geometry documents of mems-sketch become CIF. The documents are written here in its documented form; numbers are closed forms."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

import bimorph
from bimorph import geometry


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    """A rectangle."""
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def document(**changes: Any) -> dict[str, Any]:
    """A cantilever of 100 µm by 2 µm with a mask of its anchor; the pad has a hole, which the anchor covers."""
    whole: dict[str, Any] = {
        "format": "mems-sketch-geometry/1",
        "component": "top",
        "unit": "um",
        "layers": {
            "device": {"gds": [1, 0], "polygons": [{"hull": box(-40, -20, 0, 20), "holes": [box(-25, -5, -15, 5)]}, box(0, -1, 100, 1)]},
            "anchor": {"gds": [[2, 0]], "polygons": {"hull": box(-40, -20, 0, 20)}},
        },
        "points": {"tip": {"x": 100, "y": 0}},
    }
    return {**whole, **changes}


PROCESS = """name = "mine"
about = "one layer"

[material.poly]
Youngsmodulus = 165e9
density = 2300

[[layer]]
name = "p1"
drawn = ["1/0"]
thickness = 2e-6
material = "poly"
anchors = ["2/0"]
"""


def test_a_drawing_is_a_model(client: bimorph.Client, tmp_path: Path) -> None:
    """The lowest mode is that of a clamped beam: 3.516·√(E·I/(ρ·A))/(2π·l²), within the 0.5 % of junctions and rotary inertia."""
    (tmp_path / "top.json").write_text(json.dumps(document()))
    (tmp_path / "mine.toml").write_text(PROCESS)
    drawing = tmp_path / "top.cif"
    drawing.write_text(geometry.cif(tmp_path / "top.json"))
    netlist = client.convert(drawing, process=tmp_path / "mine.toml").netlist
    found = client.compile(netlist).modes(count=1).frequencies_hz[0]
    expected = 3.5160 / (2 * math.pi * 100e-6**2) * math.sqrt(165e9 * (2e-6) ** 2 / 12 / 2300)
    assert found == pytest.approx(expected, rel=5e-3)


def test_holes_run_against_their_hull() -> None:
    """A hull with a hole is one contour whose area is the difference, whatever the order of its points."""
    for hole in (box(-25, -5, -15, 5), list(reversed(box(-25, -5, -15, 5)))):
        layers = {"device": {"gds": [1, 0], "polygons": [{"hull": box(-40, -20, 0, 20), "holes": [hole]}]}}
        line = next(line for line in geometry.cif(document(layers=layers)).splitlines() if line.startswith("P "))
        numbers = [int(n) for n in line[2:-1].split()]
        points = list(zip(numbers[::2], numbers[1::2], strict=True))
        twice = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, [*points[1:], points[0]], strict=True))
        assert abs(twice) / 2 == (40 * 40 - 10 * 10) * 1e6


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"format": "mems-sketch-geometry/2"}, "format: expected 'mems-sketch-geometry/1'"),
        ({"unit": "nm"}, "unit: expected 'um'"),
        ({"layers": {}}, "layers: expected"),
        ({"layers": {"a": {"gds": [1], "polygons": []}}}, "layers.a.gds: expected"),
        ({"layers": {"a": {"gds": [1, 0], "polygons": [[[0, 0], [1, 0]]]}}}, "layers.a.polygons[0]: expected at least three rows"),
        ({"layers": {"a": {"gds": [1, 0], "polygons": [[[0, 0], [1, 0], [2, 0]]]}}}, "layers.a.polygons[0]: expected a polygon with an area"),
        ({"layers": {"a": {"gds": [1, 0], "polygons": [{"hull": [[0, 0], [1, 0], ["x", 0]]}]}}}, "layers.a.polygons[0].hull: expected"),
        ({"layers": {"a": {"gds": [1, 0], "polygons": [{"outline": []}]}}}, "layers.a.polygons[0]: expected an object"),
    ],
)
def test_faults_are_named(changes: dict[str, Any], expected: str) -> None:
    """Each fault is one error with the place in the document."""
    with pytest.raises(bimorph.InvalidRequest) as raised:
        geometry.cif(document(**changes))
    assert str(raised.value).startswith(expected)
