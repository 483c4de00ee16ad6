"""The library's cells as gdsfactory draws them are those that the netlist models. Skipped in words where gdsfactory is not installed.

References: the drawing that ``bimorph layout`` makes of the same netlist, measured by KLayout, which comes with gdsfactory; modes of that
netlist.
"""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import pytest

import bimorph
from bimorph import layout

gf = pytest.importorskip("gdsfactory", reason="gdsfactory is not installed: its components are not tested")
kdb = pytest.importorskip("klayout.db", reason="KLayout is not installed: drawings are not compared")
gdstk = pytest.importorskip("gdstk", reason="gdstk is not installed: drawings are not read by it")

MASKS = ((45, 0), (43, 0))


@pytest.fixture(autouse=True)
def pdk() -> None:
    gf.gpdk.PDK.activate()


def pcells() -> Any:
    from bimorph import pcells

    return pcells


def region(path: Path, mask: tuple[int, int]) -> Any:
    """What is drawn on a mask [nm], with its lower left corner at the origin."""
    file = kdb.Layout()
    file.read(str(path))
    tops = [cell for cell in file.top_cells() if not cell.name.startswith("$$$")]
    assert len(tops) == 1
    shapes = kdb.Region(tops[0].begin_shapes_rec(file.layer(*mask))).merged()
    whole = kdb.Region(tops[0].begin_shapes_rec(file.layer(*MASKS[0]))).bbox()
    return shapes.moved(-whole.left, -whole.bottom).transformed(kdb.ICplxTrans(file.dbu / 1e-3))


def draw(program: str, mechanism: layout.Mechanism, path: Path) -> Path:
    """The mechanism as ``bimorph layout`` draws it."""
    source = path.with_suffix(".net")
    source.write_text(mechanism.netlist().files["mechanism.net"])
    subprocess.run([program, "layout", str(source), "-o", str(path)], check=True, capture_output=True)
    return path


def chain(name: str) -> Any:
    """A component with one cell of the library between others."""
    cells = pcells()
    c = gf.Component()
    part = c.add_ref(cells.CELLS[name](), name="part")
    for k, port in enumerate([p.name for p in part.ports if p.name != "c"]):
        if name == "anchor_pad" or (name, port) in (("thermal_bimorph", "a"), ("thermal_bimorph", "g")):
            continue
        bar = c.add_ref(cells.plain_beam(length=30), name=f"bar{k}")
        bar.connect("a", part[port])
        pad = c.add_ref(cells.anchor_pad(width=16), name=f"pad{k}")
        pad.connect("a", bar["b"])
    return c


@pytest.mark.parametrize("name", ["anchor_pad", "plain_beam", "folded_flexure", "thermal_bimorph", "serpentine"])
def test_a_cell_is_drawn_as_its_netlist_is(program: str, tmp_path: Path, name: str) -> None:
    """On both masks nothing is left over but what rounding to gdsfactory's grid of 1 nm leaves at an edge."""
    c = chain(name)
    c.write_gds(tmp_path / "theirs.gds")
    ours = draw(program, layout.from_gdsfactory(c), tmp_path / "ours.gds")
    for mask in MASKS:
        first, second = region(tmp_path / "theirs.gds", mask), region(ours, mask)
        assert first.area() > 0
        assert (first ^ second).sized(-2).is_empty(), (name, mask)


def test_a_comb_lies_within_its_drawing(program: str, tmp_path: Path) -> None:
    """`bimorph layout` draws spines of its own behind those of the cell; nothing of the cell is missing."""
    c = chain("comb_drive")
    c.write_gds(tmp_path / "theirs.gds")
    ours = draw(program, layout.from_gdsfactory(c), tmp_path / "ours.gds")
    assert (region(tmp_path / "theirs.gds", MASKS[0]) - region(ours, MASKS[0])).sized(-2).is_empty()


def resonator() -> Any:
    """A folded flexure between two combs, one of them mirrored, with pads; 6 fingers."""
    cells = pcells()
    c = gf.Component()
    spring = c.add_ref(cells.folded_flexure(length=150.0005), name="spring")
    for side, mirrored in (("right", False), ("left", True)):
        comb = c.add_ref(cells.comb_drive(fingers=6), name=f"comb_{side}")
        if mirrored:
            comb.mirror_x()
        comb.connect("a", spring[side])
        pad = c.add_ref(cells.anchor_pad(width=20), name=f"pad_{side}")
        pad.connect("a", comb["b"])
        c.add_port(f"stator_{side}", port=comb["b"])
    return c


def test_what_is_drawn_moves_as_its_netlist(client: bimorph.Client, tmp_path: Path) -> None:
    """Three modes by geometry from the GDS are those by `get_netlist()`, within 2 %: fingers bend in the one and not in the other."""
    c = resonator()
    c.write_gds(tmp_path / "resonator.gds")
    m = layout.from_gdsfactory(c)
    m.line("eground * [spring_c] []\neground * [stator_left] []\ndrive port * [stator_right] []")
    by_netlist = client.compile(m.netlist()).modes(count=3).frequencies_hz
    converted = client.convert(tmp_path / "resonator.gds")
    assert (converted.by, converted.unrecognised) == ("geometry", ())
    by_geometry = client.compile(tmp_path / "resonator.gds").modes(count=3).frequencies_hz
    assert by_geometry == pytest.approx(by_netlist, rel=0.02)


def test_settings_keep_their_digits() -> None:
    """A length of 150.0005 µm is not rounded, as `get_netlist()` does to 1 nm by default; numbers are decimal."""
    text = layout.from_gdsfactory(resonator()).netlist().files["mechanism.net"]
    assert "length=0.0001500005" in text and "overlap=2e-05" in text


def test_more_than_two_ports_are_one_node(client: bimorph.Client) -> None:
    """Three beams that meet, which `get_netlist()` refuses by default, are one node; so are ports of other widths."""
    cells = pcells()
    c = gf.Component()
    first = c.add_ref(cells.plain_beam(length=50), name="first")
    for k, angle in enumerate((60, -60)):
        beam = c.add_ref(cells.plain_beam(length=50), name=f"next{k}")
        beam.rotate(angle)
        beam.move((50, 0))
        pad = c.add_ref(cells.anchor_pad(), name=f"pad{k}")
        pad.connect("a", beam["b"])
    m = layout.from_gdsfactory(c)
    lines = [
        line.split("[")[1].split("]")[0].split() for line in m.netlist().files["mechanism.net"].splitlines() if " plain_beam p1 " in line
    ]
    assert len({lines[0][1], lines[1][0], lines[2][0]}) == 1
    assert client.compile(m.netlist()).unknowns > 0
    assert first is not None


@pytest.mark.parametrize("turned", [0, 90, 37])
@pytest.mark.parametrize("mirrored", [False, True])
def test_arrays_inside_turned_components(program: str, tmp_path: Path, turned: float, mirrored: bool) -> None:
    """An array of 2 × 3 bimorphs in a component that is turned and mirrored is six bimorphs in their places: nothing of one drawing is
    missing in the other but for what rounding leaves at an edge."""
    inner = gf.Component()
    inner.add_ref(pcells().thermal_bimorph(), name="arm", columns=2, rows=3, column_pitch=400, row_pitch=100)
    outer = gf.Component()
    whole = outer.add_ref(inner, name="bank")
    if mirrored:
        whole.mirror_y()
    whole.rotate(turned)
    outer.write_gds(tmp_path / "theirs.gds")
    m = layout.from_gdsfactory(outer)
    text = m.netlist().files["mechanism.net"]
    assert text.count(" thermal_bimorph p1 ") == 6 and text.count("pos *") == 5
    ours = draw(program, m, tmp_path / "ours.gds")
    for mask in MASKS:
        assert (region(tmp_path / "theirs.gds", mask) ^ region(ours, mask)).sized(-4).is_empty()


def test_three_programs_read_our_drawing_alike(program: str, client: bimorph.Client, tmp_path: Path) -> None:
    """Unit, cell, labels and merged area of what ``bimorph layout`` writes are the same in gdstk, KLayout, gdsfactory and here."""
    m = layout.from_gdsfactory(chain("thermal_bimorph"))
    path = draw(program, m, tmp_path / "bimorph.gds")
    library = gdstk.read_gds(path)
    (cell,) = library.cells
    assert (library.unit, library.precision) == (1e-6, 1e-12)
    polygons = [p for p in cell.polygons if (p.layer, p.datatype) == MASKS[0]]
    by_gdstk = sum(p.area() for p in gdstk.boolean(polygons, [], "or", precision=1e-6))
    file = kdb.Layout()
    file.read(str(path))
    (top,) = file.top_cells()
    by_klayout = kdb.Region(top.begin_shapes_rec(file.layer(*MASKS[0]))).merged().area() * file.dbu**2
    by_gdsfactory = gf.import_gds(path).area(MASKS[0])
    ours = client.convert(path).drawn_m2 * 1e12
    assert cell.name == top.name == "bimorph" and math.isclose(file.dbu, 1e-6)
    assert by_gdstk == pytest.approx(ours, rel=1e-9) and by_klayout == pytest.approx(ours, rel=1e-9)
    # on a grid of 1 nm
    assert by_gdsfactory == pytest.approx(ours, rel=1e-6)
    texts = {(label.text, tuple(round(x, 6) for x in label.origin)) for label in cell.labels}
    seen = set()
    for layer in file.layer_indexes():
        for shape in top.shapes(layer).each():
            if shape.is_text():
                at = shape.dtext.position()
                seen.add((shape.text_string, (round(at.x, 6), round(at.y, 6))))
    assert texts == seen and len(texts) > 15
