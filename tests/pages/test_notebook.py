"""A page becomes a notebook that runs: every block is a cell, results and pictures are in it, and a kernel computes the same."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from conftest import program_path
from notebook import write
from runner import ROOT, Page


def test_a_tutorial_as_notebook(tmp_path: Path) -> None:
    """The varactor: its cells have the results of the page, and its pictures; run by Jupyter, where that is installed, they print the same."""
    program = program_path()
    if not program:
        pytest.skip("the program bimorph is not built")
    out = tmp_path / "varactor.ipynb"
    made = tmp_path / "made"
    made.mkdir()
    report = write(ROOT / "docs/tutorials/varactor.md", made, program, out)
    assert not report.failures
    document = json.loads(out.read_text())
    code = [cell for cell in document["cells"] if cell["cell_type"] == "code"]
    printed = "".join(output["text"] for cell in code for output in cell["outputs"])
    assert "pull-in  11.57 V" in printed and "pull-in 11.57 V, C 177.1 fF to 265.6 fF" in printed
    assert sum(len(cell.get("attachments", {})) for cell in document["cells"]) == 3
    assert "%%writefile varactor.net" in code[0]["source"]

    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    again = nbformat.reads(out.read_text(), as_version=4)
    nbformat.validate(again)
    folder = tmp_path / "again"
    folder.mkdir()
    page = Page("varactor", folder, program)
    page.end()
    environment = dict(os.environ)
    os.environ.update(page.environment)
    try:
        nbclient.NotebookClient(again, timeout=120, resources={"metadata": {"path": str(folder)}}).execute()
    finally:
        os.environ.clear()
        os.environ.update(environment)
    printed = "".join(output.get("text", "") for cell in again.cells if cell.cell_type == "code" for output in cell.outputs)
    assert "pull-in  11.57 V" in printed and "pull-in 11.57 V, C 177.1 fF to 265.6 fF" in printed
