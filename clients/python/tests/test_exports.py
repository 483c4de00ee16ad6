"""Models for other simulators against a real server: the text is that of ``bimorph export``."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import PLATE

import bimorph

CHEVRON = """process p1 = [Youngsmodulus=165e9 density=2300 viscosity=1.78e-5 fluid=2u h=2u permittivity=8.854e-12
  sheetresistance=20 thermcond=30 thermalexpansion=2.33e-6 ambienttemperature=293]
anchor p1 [a] [l=10u w=10u oz=pi]
left  beam2det p1 [a c] [l=120u w=2u oz=0.1 tau=20u]
right beam2det p1 [c b] [l=120u w=2u oz=-0.1]
anchor p1 [b] [l=10u w=10u]
plategap2d * [c k] [A=1e-8 gap=3u oz=pi/2]
anchor p1 [k] [l=5u w=5u]
eground * [b] []
heat port * [a] []
sense port * [k] []
"""


def written(program: str, folder: Path, text: str, *words: str) -> tuple[str, str]:
    """What the command writes about this netlist, and its document, if there is one."""
    (folder / "part.net").write_text(text)
    command = [program, "export", "part.net", *words, "--out", "out.txt"]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    return (folder / "out.txt").read_text(), ran.stdout


@pytest.mark.parametrize("language", ["spice", "verilog-a"])
def test_the_text_is_that_of_the_command(client: bimorph.Client, program: str, tmp_path: Path, language: str) -> None:
    """Linear about an operating point with ports of other kinds and scales, and nonlinear; what the document says of it."""
    model = client.compile(bimorph.Netlist.text(CHEVRON, "part.net"))
    ports = {"heat": 1.0, "sense": 1.0, "c.y": 2e6}
    found = model.export(language, ports=ports, signals={"c.y": 1e6, "left.T": 1.0}, voltages={"heat": 1.0, "sense": 3.0}, to=2e6, name="part_two")  # type: ignore[arg-type]
    words = "--port heat=1 --port sense=3 --ports heat:1,sense:1,c.y:2M --signals c.y:1M,left.T --to 2M --name part_two --json".split()
    text, document = written(program, tmp_path, CHEVRON, f"--{language}", *words)
    about = json.loads(document)
    assert found.text == text and found.name == about["name"] == "part_two" and list(found.pins) == about["pins"]
    assert found.frequencies_hz.tolist() == about["frequencies_hz"] and found.quality.tolist() == about["quality"]
    assert found.band_hz is not None and found.band_hz[1] == 2e6
    assert (found.error, found.unknowns, found.estimated_error) == (about["error"], about["unknowns"], about["estimated_error"])
    assert found.lags == 1 and len(found.numbers) == len(found.frequencies_hz) > 0
    plate = client.compile(bimorph.Netlist.text(PLATE, "part.net"))
    whole = plate.export(language, nonlinear=True, signals=["m.x"])  # type: ignore[arg-type]
    assert whole.text == written(program, tmp_path, PLATE, f"--{language}", "--nonlinear", "--signals", "m.x")[0]
    assert (whole.directions, whole.gaps, whole.error, len(whole.frequencies_hz)) == (1, 1, None, 0)
    whole.save(tmp_path / "saved.txt")
    assert (tmp_path / "saved.txt").read_text() == whole.text


def test_an_export_as_tables_and_pictures(plate: bimorph.Model) -> None:
    """The one mode of the plate under bias, √(k/m) softened by the field, in every form."""
    found = plate.export(signals=["m.x"], voltages={"drive": 2.0})
    assert isinstance(found.frequencies_hz, np.ndarray) and math.isinf(found.quality[0])
    assert found.frequencies_hz[0] == pytest.approx(plate.modes(1, {"drive": 2.0}).frequencies_hz[0], rel=1e-6)
    assert repr(found) == "<ExportResult plate in spice: 1 modes, 3 pins>"
    assert "frequency [Hz]" in found._repr_html_() and "p_drive n_drive s_m_x" in found._repr_html_()
    assert "1 directions in which parts slide" in plate.export(nonlinear=True)._repr_html_()
    pytest.importorskip("pandas")
    assert list(found.to_pandas().columns) == ["frequency_hz", "quality"] and found.to_pandas().attrs["units"]["frequency_hz"] == "Hz"
    pytest.importorskip("xarray")
    assert found.to_xarray()["frequency_hz"].attrs["units"] == "Hz"
    pytest.importorskip("matplotlib").use("Agg")
    assert found.plot().get_xlabel() == "f [Hz]"


def test_a_file_without_modes_is_reported(plate: bimorph.Model) -> None:
    """At 0 V the port sees no motion."""
    with pytest.warns(bimorph.AccuracyWarning, match="no mode"):
        found = plate.export()
    assert any("no mode" in warning for warning in found.warnings)


def test_refusals(client: bimorph.Client, plate: bimorph.Model, tmp_path: Path) -> None:
    """Unknown names and values beyond their range are rejected by the name of their argument; a model that cannot be written has no result."""
    for what, keywords in [
        ("language", {"language": "vhdl"}),
        ("ports", {"ports": ["nosuch"]}),
        ("ports", {"ports": ["frame.wz"]}),
        ("ports", {"ports": {"m.x": 0.0}}),
        ("signals", {"signals": ["nosuch.x"]}),
        ("voltages", {"voltages": {"nosuch": 1.0}}),
        ("to", {"to": -1.0}),
        ("within", {"within": 1.0}),
        ("count", {"count": 1001}),
        ("name", {"name": "2a"}),
        ("voltages", {"nonlinear": True, "voltages": {"drive": 1.0}}),
        ("to", {"nonlinear": True, "to": 1e5}),
        ("count", {"nonlinear": True, "count": 1}),
    ]:
        with pytest.raises(bimorph.InvalidRequest, match=f"^{what}"):
            plate.export(**keywords)  # type: ignore[arg-type]
    with pytest.raises(bimorph.NoResult, match="heats"):
        client.compile(bimorph.Netlist.text(CHEVRON, "part.net")).export(nonlinear=True)
    with pytest.raises(OSError, match="path: "):
        plate.export(voltages={"drive": 1.0}).save(tmp_path / "gone" / "a.lib")
