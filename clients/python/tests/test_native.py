"""Why there are no models in process."""

from __future__ import annotations

import importlib
from collections.abc import Iterator

import pytest

import bimorph
from bimorph import native


@pytest.fixture
def unloaded() -> Iterator[None]:
    """The module is looked for anew, before and after."""
    native._loaded.cache_clear()
    yield
    native._loaded.cache_clear()


def fails(monkeypatch: pytest.MonkeyPatch, error: ImportError) -> None:
    def load(name: str) -> None:
        raise error

    monkeypatch.setattr(importlib, "import_module", load)


def test_a_module_that_cannot_be_loaded_is_not_one_that_is_missing(monkeypatch: pytest.MonkeyPatch, unloaded: None) -> None:
    """A module that the loader refuses gives the loader's reason; without one the package says how to get it."""
    fails(monkeypatch, ImportError("libpython3.11.so.1.0: cannot open shared object file"))
    with pytest.raises(bimorph.BimorphError, match="cannot be loaded .libpython3.11.so.1.0: cannot open"):
        bimorph.local()
    native._loaded.cache_clear()
    fails(monkeypatch, ModuleNotFoundError("No module named 'bimorph._native'"))
    with pytest.raises(bimorph.BimorphError, match="make wheel"):
        bimorph.local()
