"""The Python blocks of the pages run as they are written, in order, in an empty folder."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

import bimorph

PACKAGE = Path(bimorph.__file__).resolve().parents[1]
NEEDS = {"bimorph.local()": "bimorph._native", "gdsfactory": "gdsfactory", "to_pandas()": "pandas", "to_xarray()": "xarray", ".plot(": "matplotlib"}
"""Modules that may not be installed, by a word of the blocks that use them."""


def blocks(page: Path) -> list[tuple[int, str]]:
    """The Python blocks of a page, each with the number of its first line."""
    text = page.read_text()
    return [(text[: found.start(1)].count("\n") + 1, found[1]) for found in re.finditer(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)]


PAGES = [page for page in (ROOT / "README.md", ROOT / "clients/python/README.md", *sorted((ROOT / "docs").rglob("*.md"))) if page.is_file() and blocks(page)]


def run(words: list[str], folder: Path, program: str) -> None:
    """Runs Python in a folder, with warnings about accuracy and netlists as errors.

    Raises :class:`AssertionError` with its output where it fails."""
    path = os.pathsep.join(filter(None, [str(PACKAGE), os.environ.get("PYTHONPATH", "")]))
    environment = {**os.environ, "BIMORPH_BIN": program, "PYTHONPATH": path, "MPLBACKEND": "Agg", "PYTHONWARNINGS": "error::UserWarning:__main__"}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-4000:]}"


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_blocks_run_as_written(page: Path, tmp_path: Path, program: str) -> None:
    """Every block in order in one interpreter; one with test functions in pytest, with the files of the others. A block is left out where a module
    that it needs is not installed."""
    script, tests = [], []
    for line, block in blocks(page):
        if any(word in block and importlib.util.find_spec(module) is None for word, module in NEEDS.items()):
            continue
        (tests if re.search(r"^def test_", block, re.MULTILINE) else script).append("\n" * (line - 1 - sum(b.count("\n") for b in script)) + block)
    if not script and not tests:
        pytest.skip("none of the modules that its blocks need is installed")
    (tmp_path / "blocks.py").write_text("".join(script))
    run(["blocks.py"], tmp_path, program)
    for k, block in enumerate(tests):
        (tmp_path / f"test_block{k}.py").write_text(block)
        run(["-m", "pytest", "-q", "-p", "no:cacheprovider", f"test_block{k}.py"], tmp_path, program)


def test_pages_with_blocks_are_found() -> None:
    """The page of the client is among them, with a block for each way to use it."""
    page = ROOT / "clients/python/README.md"
    if not page.is_file():
        pytest.skip("the tests are run without the repository")
    assert page in PAGES and len(blocks(page)) >= 9
