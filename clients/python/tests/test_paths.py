"""Paths, permanent strains and further snaps against a real server; values are compared with the documents of the command (``--json``)."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import PLATE

import bimorph

EPS0, K, A, GAP = 8.854e-12, 1.0, 1e-8, 2e-6
PULL_IN = math.sqrt(8 * K * GAP**3 / (27 * EPS0 * A))

SILICON = "process p1 = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.33e-6 thermcond=41 sheetresistance=20 ambienttemperature=293]\n"

COLUMN = f"""{SILICON}param F=0
param side=1n
anchor p1 [a] [l=10u w=10u oz=pi]
beam2d p1 [a m] [l=100u w=2u]
beam2d p1 [m b] [l=100u w=2u]
guide2d * [b] []
f2d * [b] [F=F oz=pi]
f2d * [m] [F=side oz=pi/2]
"""

BAR = f"""{SILICON}anchor p1 [a] []
left beam2det p1 [a m] [l=25u w=4u yieldstress=100e6 softening=1293]
right beam2det p1 [m b] [l=25u w=4u]
anchor p1 [b] [oz=pi]
eground * [b] []
heat port * [a] []
"""

ROW = """anchor * [f] []
spring2d * [f q] [kx=1]
mass2d * [q] [m=1e-12]
guide2d * [q] []
spring2d * [q r] [kx=0.5]
mass2d * [r] [m=1e-12]
guide2d * [r] []
anchor * [d] []
anchor * [e] []
first plategap2d * [q d] [A=1e-8 gap=2u]
second plategap2d * [r e] [A=1.5e-8 gap=5u]
R * [q r] [R=1]
R * [d e] [R=1]
eground * [e] []
drive port * [q e] []
"""


def documented(program: str, folder: Path, text: str, *words: str) -> Any:
    """The document of the command about this netlist."""
    (folder / "part.net").write_text(text)
    command, *rest = words
    ran = subprocess.run([program, command, "part.net", *rest, "--json"], cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    return json.loads(ran.stdout)


def compiled(client: bimorph.Client, text: str) -> bimorph.Model:
    """The netlist on a server."""
    return client.compile(bimorph.Netlist.text(text, "part.net"))


def check_path(found: bimorph.PathResult, document: Any) -> None:
    """Equal numbers, to the bit."""
    assert found.values.tolist() == document["values"] and found.negative.tolist() == document["negative"]
    assert {name: column.tolist() for name, column in found.signals.items()} == document["signals"] and found.units == document["units"]
    for points, key in ((found.limit_points, "folds"), (found.bifurcations, "bifurcations")):
        assert [{"value": one.value, "point": one.point} for one in points] == document[key]
    assert {name: {"x": node.x, "y": node.y, "rz": node.rz} for name, node in found.last.items()} == document["last"]
    keys = ("along", "end", "unknowns", "iterations", "estimated_error")
    assert [getattr(found, key) for key in keys] == [document[key] for key in keys]


def test_paths_are_those_of_the_command(client: bimorph.Client, program: str, tmp_path: Path) -> None:
    """Along a port past pull-in, along a parameter of the netlist on either branch, and along all loads."""
    plate, column = compiled(client, PLATE), compiled(client, COLUMN)
    check_path(plate.path("drive", 0.0, 8.0), documented(program, tmp_path, PLATE, "path", "--along", "drive=0:8"))
    for branch in ("plus", "minus", "stay"):
        words = ("path", "--along", "F=0:260u", "--signals", "m.y", "--branch", branch)
        check_path(column.path("F", 0.0, 2.6e-4, ["m.y"], branch=branch), documented(program, tmp_path, COLUMN, *words))  # type: ignore[arg-type]
    check_path(column.path("loads", 0, 2, points=30), documented(program, tmp_path, COLUMN, "path", "--along", "loads=0:2", "--points", "30"))


def test_a_path_as_tables_and_pictures(plate: bimorph.Model) -> None:
    """A plate pulls in at √(8kg³/27εA); units, stability and the limit point in every form."""
    found = plate.path("drive", 0.0, 8.0, ["m.x"])
    (first, *_) = found.limit_points
    assert found.unit == "V" and first.value == pytest.approx(PULL_IN, rel=1e-3)
    assert found.stable[: first.point].all() and not found.stable[first.point + 1]
    assert isinstance(found.signals["m.x"], np.ndarray) and found.values.dtype == np.float64
    assert repr(found).startswith("<PathResult along drive from 0 to ")
    html = found._repr_html_()
    assert "drive [V]" in html and "limit point" in html and html.count("<tr>") == 3 + len(found.limit_points) + len(found.bifurcations)
    pytest.importorskip("pandas")
    frame = found.to_pandas()
    assert frame.index.name == "drive" and list(frame.columns) == ["m.x", "negative"]
    assert frame.attrs["units"] == {"drive": "V", "m.x": "m", "negative": "1"}
    pytest.importorskip("xarray")
    dataset = found.to_xarray()
    assert dataset["m.x"].attrs["units"] == "m" and dataset["value"].attrs["units"] == "V" and dataset.attrs["end"] == found.end
    assert (dataset["value"].values == found.values).all()
    pytest.importorskip("matplotlib").use("Agg")
    ax = found.plot()
    assert ax.get_xlabel() == "drive [V]"
    assert {line.get_linestyle() for line in ax.get_lines()} >= {"-", "--"}


def test_backbending(client: bimorph.Client, program: str, tmp_path: Path) -> None:
    """Permanent strains, and the equilibrium after them, at rest and at a voltage."""
    model = compiled(client, BAR)
    for volts in (0.0, 1.0):
        document = documented(program, tmp_path, BAR, "static", "--backbend", "heat=2.8", "--port", f"heat={volts}")
        found = model.static({"heat": volts}, backbend={"heat": 2.8})
        assert found.permanent_strains == document["permanent_strains"]
        assert {name: {"x": node.x, "y": node.y, "rz": node.rz} for name, node in found.nodes.items()} == document["nodes"]
        assert found.temperatures_k == document["temperatures_k"] and found.estimated_error == document["estimated_error"]
    assert list(found.permanent_strains) == ["left"] and found.permanent_strains["left"] < -1e-3 and "permanent strain of left" in found._repr_html_()
    assert model.static({"heat": 1.0}).permanent_strains == {}


def test_further_snaps(client: bimorph.Client, program: str, tmp_path: Path) -> None:
    """The second of two plates closes after the first and holds it longer."""
    document = documented(program, tmp_path, ROW, "pullin", "--max", "20")
    found = compiled(client, ROW).pull_in(20.0)
    keys = ("port", "pull_in_v", "release_v", "release_before_snaps_v", "held", "estimated_error")
    assert [getattr(found, key) for key in keys] == [document[key] for key in keys]
    assert list(found.snaps_v) == document["snaps_v"] and len(found.snaps_v) == 1
    assert "snaps further at" in found._repr_html_()
    pytest.importorskip("pandas")
    assert found.to_pandas().loc["drive", "release_before_snaps_v"] == found.release_before_snaps_v
    pytest.importorskip("xarray")
    assert found.to_xarray()["snaps_v"].values.tolist() == list(found.snaps_v)


def test_currents_into_ports_during_a_run(plate: bimorph.Model, program: str, tmp_path: Path) -> None:
    """Charge and current at held voltages are those of the command; the integral of the current is the charge that came."""
    found = plate.transient(5e-5, ["drive.i", "drive.q", "m.x"], points=401, voltages={"drive": 3.0})
    document = documented(program, tmp_path, PLATE, "tran", "--stop", "50u", "--points", "401", "--signals", "drive.i,drive.q,m.x", "--port", "drive=3")
    assert {name: column.tolist() for name, column in found.signals.items()} == document["signals"]
    assert found.units == {"drive.i": "A", "drive.q": "C", "m.x": "m"}
    came = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(found.t) * (found.signals["drive.i"][1:] + found.signals["drive.i"][:-1]))])
    charge = found.signals["drive.q"] - found.signals["drive.q"][0]
    assert np.allclose(came, charge, rtol=0.0, atol=1e-3 * np.ptp(charge))
    with pytest.raises(bimorph.InvalidRequest, match="signals: .*PORT.i"):
        plate.transient(5e-5, ["drove.i"], voltages={"drive": 3.0})


def test_sums_of_signals(plate: bimorph.Model, client: bimorph.Client) -> None:
    """A sum has the values of its terms in runs, paths, responses, sessions and sweeps, and its text as its name."""
    text, names = "m.x-0.25*m.x", ["m.x", "m.x-0.25*m.x"]

    def holds(columns: Any) -> None:
        assert np.allclose(columns[text], 0.75 * np.asarray(columns["m.x"]), rtol=1e-12, atol=0.0)

    run = plate.transient(2e-5, names, points=11, voltages={"drive": 3.0}, events=[(text, 1e-9)])
    holds(run.signals)
    assert run.units[text] == "m"
    assert run.events[0].signal == text
    holds(plate.path("drive", 0.0, 2.0, signals=names).signals)
    holds(plate.ac("m.fx", names, start=1e3, stop=1e5, points=11).signals)
    with plate.session(names) as session:
        holds(session.operating_point({"drive": 3.0}).outputs)
    table = client.sweep(bimorph.Netlist.text(PLATE, "plate.net"), {"k": [1.0, 2.0]}, bimorph.Static(names, {"drive": 1.0}))
    holds({name: table.column(name) for name in names})
    with pytest.raises(bimorph.InvalidRequest, match="same unit"):
        plate.transient(2e-5, ["m.x-m.vx"])


def test_refusals(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Unknown names, values beyond their range and too many points are rejected by the name of their argument."""
    for what, along, keywords in [
        ("along", "nosuch", {"start": 0.0, "stop": 1.0}),
        ("start", "drive", {"start": math.nan, "stop": 1.0}),
        ("start", "drive", {"start": 1e300, "stop": 1.0}),
        ("stop", "drive", {"start": 0.0, "stop": -1e300}),
        ("stop", "drive", {"start": 1.0, "stop": 1.0}),
        ("signals", "drive", {"start": 0.0, "stop": 1.0, "signals": ["nosuch.x"]}),
        ("voltages", "drive", {"start": 0.0, "stop": 1.0, "voltages": {"nosuch": 1.0}}),
        ("branch", "drive", {"start": 0.0, "stop": 1.0, "branch": "up"}),
        ("points", "drive", {"start": 0.0, "stop": 1.0, "points": 2_000_000_000}),
    ]:
        with pytest.raises(bimorph.InvalidRequest, match=f"^{what}"):
            plate.path(along, **keywords)  # type: ignore[arg-type]
    with pytest.raises(bimorph.LimitExceeded, match="points.*message_bytes"):
        plate.path("drive", 0.0, 1.0, ["m.x"] * 40, points=1_000_000)
    with pytest.raises(bimorph.InvalidRequest, match="^backbend: .*nosuch"):
        compiled(client, BAR).static(backbend={"nosuch": 1.0})
    with pytest.raises(bimorph.InvalidRequest, match="^backbend.*yieldstress"):
        plate.static(backbend={"drive": 1.0})
