"""Cells are subnets, and layouts go through the server. Numbers are closed forms, or those of the same netlist by another way."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path
from typing import Any

import pytest

import bimorph
from bimorph import layout

E, RHO, H = 165e9, 2300.0, 2e-6


def test_a_folded_flexure_is_as_stiff_as_its_beams(client: bimorph.Client) -> None:
    """Four pairs of beams in series: 4·(12·E·I/l³)/2 along x, within the 3 % by which trusses and junctions give way."""
    m = layout.Mechanism()
    m.add("spring", layout.folded_flexure(length=200e-6, width=2e-6, truss=40e-6), c="shuttle")
    m.line("f2d * [shuttle] [F=1u]")
    inertia = H * (2e-6) ** 3 / 12
    stiffness = 4 * (12 * E * inertia / 200e-6**3) / 2
    x = client.compile(m.netlist(), junctions="centreline", linear=True).static().nodes["shuttle"].x
    assert x == pytest.approx(1e-6 / stiffness, rel=0.03)


@pytest.mark.parametrize("name", sorted(layout.KINDS))
def test_every_cell_is_a_netlist(client: bimorph.Client, name: str) -> None:
    """Each cell of the library compiles with its defaults, held where it does not hold itself."""
    kind = layout.KINDS[name]
    m = layout.Mechanism()
    m.add("part", kind(), **{node: f"at_{node}" for node in kind.nodes})
    if name in ("comb_drive", "serpentine"):
        first, last = kind.nodes
        m.line(f"anchor p1 [at_{last}] []")
        m.line(f"beam2d p1 [at_{first} held] [l=50u w=2u oz=pi/2]")
        m.line("anchor p1 [held] []")
    m.line(f"anchor p1 [extra] []\nbeam2d p1 [extra at_{kind.nodes[0]}] [l=50u w=2u oz=pi/2]" if name == "anchor_pad" else "")
    assert client.compile(m.netlist()).unknowns >= 0


def test_wrong_settings_are_told(client: bimorph.Client) -> None:
    """Names and numbers that a cell has not are refused where they are written."""
    with pytest.raises(TypeError, match="no parameter 'lenght'; there are length"):
        layout.folded_flexure(lenght=1e-4)
    with pytest.raises(ValueError, match="finite number"):
        layout.comb(gap=math.nan)
    m = layout.Mechanism()
    with pytest.raises(ValueError, match="has the nodes a, b; got a"):
        m.add("c", layout.comb(), a="x")
    with pytest.raises(ValueError, match="is no name"):
        m.add("c d", layout.comb(), a="x", b="y")


NETLIST = {
    "instances": {
        "spring": {"component": "folded_flexure", "settings": {"length": 150.0, "width": 2.0}},
        "drive": {"component": "comb_drive", "settings": {"fingers": 30, "gap": 2.0}},
        "pad-1": {"component": "anchor_pad", "settings": {}},
    },
    "placements": {"spring": {"rotation": 0, "mirror": False}, "drive": {"rotation": 90.0}},
    "nets": [{"p1": "spring,c", "p2": "drive,a"}, {"p1": "drive,b", "p2": "pad-1,a"}],
    "ports": {"stator": "drive,b"},
}


def test_a_gdsfactory_netlist_becomes_subnets(client: bimorph.Client) -> None:
    """What ``get_netlist()`` gives: instances with settings in micrometres, nets, outer ports."""
    text = layout.from_gdsfactory(NETLIST).netlist().files["mechanism.net"]
    assert "spring folded_flexure p1 [" in text and "length=0.00015" in text
    assert "pad_1 anchor_pad p1 [stator] []" in text
    assert "gap=2e-06" in text and f"oz={math.pi / 2!r}" in text
    assert client.compile(bimorph.Netlist.text(text)).unknowns > 0
    foreign = {"instances": {"ring": {"component": "ring_single"}}}
    with pytest.raises(ValueError, match="'ring' is a 'ring_single', which is no cell of the library"):
        layout.from_gdsfactory(foreign)


def test_arrays_and_mirrors_are_told_in_a_netlist(client: bimorph.Client) -> None:
    """`get_netlist()` of gdsfactory 9.45 gives an array once, with pitches that are turned with the cell but not mirrored, and names
    its ports by `<column.row>`; what no port joins stands where it is placed."""
    netlist = {
        "instances": {
            "arm": {
                "component": "thermal_bimorph",
                "settings": {"tau": 230.0, "layer": [45, 0]},
                "array": {"columns": 2, "rows": 1, "column_pitch": 400, "row_pitch": 0},
            },
            "bar": {"component": "plain_beam", "settings": {"length": 50}},
        },
        "placements": {
            "arm": {"x": 0, "y": 0, "rotation": 90, "mirror": True},
            "bar": {"x": 23, "y": 230, "rotation": 0, "mirror": False},
        },
        "nets": ({"p1": "arm<0.0>,o", "p2": "bar,a"},),
        "ports": {},
    }
    text = layout.from_gdsfactory(netlist).netlist().files["mechanism.net"]
    assert "tau=0.00023" in text and f"oz={math.pi / 2!r} ox=pi" in text
    assert "pos * [arm_0_0_a arm_1_0_a]" in text and "y=0.0004" in text
    o = next(line for line in text.splitlines() if line.startswith("arm_0_0 ")).split("[")[1].split("]")[0].split()[2]
    assert f"bar plain_beam p1 [{o} " in text
    assert client.compile(bimorph.Netlist.text(text)).unknowns > 0


def test_a_gdsfactory_component_becomes_subnets(client: bimorph.Client) -> None:
    """The same from a component that gdsfactory itself put together."""
    gf = pytest.importorskip("gdsfactory")
    layer = (45, 0)

    @gf.cell
    def comb_drive(fingers: int = 20, gap: float = 2.0) -> gf.Component:
        c = gf.Component()
        c.add_polygon([(0, 0), (40, 0), (40, fingers * gap), (0, fingers * gap)], layer=layer)
        c.add_port("a", center=(0, 5), width=2, orientation=180, layer=layer, port_type="electrical")
        c.add_port("b", center=(40, 5), width=2, orientation=0, layer=layer, port_type="electrical")
        return c

    @gf.cell
    def anchor_pad(length: float = 10.0) -> gf.Component:
        c = gf.Component()
        c.add_polygon([(0, 0), (length, 0), (length, 10), (0, 10)], layer=layer)
        c.add_port("a", center=(0, 5), width=2, orientation=180, layer=layer, port_type="electrical")
        return c

    gf.gpdk.PDK.activate() if hasattr(gf, "gpdk") else gf.get_generic_pdk().activate()
    top = gf.Component("top_of_a_drive")
    drive, pad = top.add_ref(comb_drive(fingers=12)), top.add_ref(anchor_pad())
    drive.name, pad.name = "drive", "pad"
    pad.connect("a", drive["b"])
    text = layout.from_gdsfactory(top).netlist().files["mechanism.net"]
    lines = {line.split()[0]: line for line in text.splitlines() if line.startswith(("drive ", "pad "))}
    node = lines["drive"].split("[")[1].split("]")[0].split()[1]
    assert "fingers=12.0" in lines["drive"] and f"[{node}]" in lines["pad"]


def test_two_nodes_never_have_one_name() -> None:
    """Ports of the whole that a netlist would call alike are refused, both named; a node without a given name makes way for one that somebody
    did, and for one that came first."""
    net: dict[str, Any] = {
        "instances": {"a": {"component": "comb_drive"}, "b": {"component": "comb_drive"}},
        "placements": {"b": {"x": 5000.0, "y": 0.0}},
        "ports": {"o-1": "a,a", "o_1": "b,a"},
    }
    with pytest.raises(ValueError, match="'o-1' and 'o_1' are both called 'o_1'"):
        layout.from_gdsfactory(net)

    def nodes(**changed: Any) -> list[str]:
        text = layout.from_gdsfactory({**net, **changed}).netlist().files["mechanism.net"]
        assert "x=0.005 y=0.0" in text
        return [node for line in text.splitlines() if " comb_drive p1 " in line for node in line.split("[")[1].split("]")[0].split()]

    # the free node b of instance a is not the port of that name
    assert nodes(ports={"a_b": "b,a"}) == ["a_a", "a_b_2", "a_b", "b_b"]
    free = {"a": {"component": "comb_drive"}, "a_a": {"component": "plain_beam"}}
    assert nodes(ports={}, instances=free, placements={"a_a": {"x": 5000.0}}) == ["a_a", "a_b"]
    assert len(set(nodes(ports={}))) == 4


def test_layouts_go_through_the_server(program: str, client: bimorph.Client, tmp_path: Path) -> None:
    """A layout compiles to the model of the netlist that it was drawn from; a broken one says where."""
    m = layout.Mechanism()
    m.add("spring", layout.folded_flexure(), c="shuttle")
    source = tmp_path / "spring.net"
    source.write_text(m.netlist().files["mechanism.net"])
    for name in ("spring.gds", "spring.cif"):
        subprocess.run([program, "layout", str(source), "-o", str(tmp_path / name)], check=True, capture_output=True)
        converted = client.convert(tmp_path / name)
        assert (converted.by, converted.process, converted.unrecognised) == ("labels", "polymumps", ())
        assert converted.drawn_m2 > 0
        drawn = client.compile(source).modes(count=2).frequencies_hz
        assert client.compile(tmp_path / name).modes(count=2).frequencies_hz == pytest.approx(drawn, rel=1e-9)
    broken = tmp_path / "broken.gds"
    broken.write_bytes((tmp_path / "spring.gds").read_bytes()[:100])
    with pytest.raises(bimorph.InvalidRequest, match="is it whole"):
        client.convert(broken)
    with pytest.raises(bimorph.InvalidRequest, match="known ones are polymumps, soi"):
        client.convert(tmp_path / "spring.gds", process="other")


def test_what_a_layout_has_lost_is_told(client: bimorph.Client, tmp_path: Path) -> None:
    """Compiled at once, a drawing warns of what is in no part of its model: here a layer that the process does not know."""
    path = tmp_path / "beam.cif"
    boxes = ["L ANCHOR1; B 2000 2000 1000 1000;", "L POLY1; B 4000 4000 1000 1000; B 10000 200 8000 1000;", "L XYZ; B 1000 1000 20000 1000;"]
    path.write_text("DS 1 1 1;\n9 BEAM;\n" + "\n".join(boxes) + "\nDF;\nC 1;\nE\n")
    with pytest.warns(bimorph.LayoutWarning, match="100 µm² of layer XYZ not understood"):
        assert client.compile(path).unknowns > 0
