"""A server for all tests; skipped aloud when the program is not built."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import bimorph

pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parents[3]
BUILDS = [ROOT / "target" / kind / "bimorph" for kind in ("release", "debug")]

PLATE = """param V=0
param k=1
anchor  * [f] [l=1u w=1u h=1u]
mass2d  * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=k]
anchor  * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=2u]
eground * [e] []
drive port * [m e] []
"""


@pytest.fixture(scope="session")
def program() -> str:
    """Path of the program."""
    found = os.environ.get("BIMORPH_BIN") or next((str(b) for b in BUILDS if b.is_file()), shutil.which("bimorph"))
    if not found:
        pytest.skip("the program bimorph is not built: cargo build, or set BIMORPH_BIN")
    return str(Path(found).resolve())


@pytest.fixture(scope="session")
def server(program: str) -> Iterator[bimorph.Server]:
    """A running server."""
    with bimorph.serve(program) as running:
        yield running


@pytest.fixture
def client(server: bimorph.Server) -> Iterator[bimorph.Client]:
    """A client of its own for each test."""
    with server.client() as connected:
        yield connected


@pytest.fixture
def plate(client: bimorph.Client) -> bimorph.Model:
    """Parallel plates on a spring: k = 1 N/m, A = 1e-8 m², gap 2 µm, m = 1e-10 kg."""
    return client.compile(bimorph.Netlist.text(PLATE, "plate.net"))
