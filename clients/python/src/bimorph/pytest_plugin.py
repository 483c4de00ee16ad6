"""Fixtures for test benches, registered with pytest when this package is installed.

``bimorph_server`` is a server for the whole run, ``bimorph_client`` a client of it for each test, and ``ngspice`` runs decks with the
plug-in loaded: ``ngspice(deck)["v(out)"]``.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator

import pytest

from . import ngspice as spice
from .client import Client
from .program import program
from .server import Server, serve


@pytest.fixture(scope="session")
def bimorph_server() -> Iterator[Server]:
    """A server for the test run. Tests that use it are skipped if the program is not found."""
    if program() is None:
        pytest.skip("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
    with serve() as server:
        yield server


@pytest.fixture
def bimorph_client(bimorph_server: Server) -> Iterator[Client]:
    """A client of :func:`bimorph_server`."""
    with bimorph_server.client() as client:
        yield client


@pytest.fixture(scope="session")
def ngspice() -> Callable[..., spice.Run]:
    """:func:`bimorph.ngspice.run`; tests that use it are skipped if ngspice or the program is not found."""
    for name, found in [("ngspice", shutil.which("ngspice")), ("bimorph", program())]:
        if found is None:
            pytest.skip(f"the program {name} was not found")
    return spice.run
