"""ngspice's shared library, driven by PySpice, with the plug-in loaded."""

import ctypes.util
import os
import pathlib
import warnings

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def plugin() -> pathlib.Path:
    """The plug-in: BIMORPH_CM, or what the last release build left."""
    named = os.environ.get("BIMORPH_CM")
    path = pathlib.Path(named) if named else ROOT / "target/release/libbimorph_ngspice.so"
    if not path.is_file():
        pytest.fail(f"{path} is missing: cargo build --release --workspace")
    return path


class Bench:
    """Runs decks and returns waveforms by name."""

    def __init__(self, shared):
        self.shared = shared

    def run(self, deck: str) -> dict:
        """Runs every analysis line of a deck; returns the waveforms of the last one as numpy arrays."""
        self.shared.load_circuit(deck)
        try:
            self.shared.run()
            plot = self.shared.plot(None, self.shared.last_plot)
            return {name: vector._data for name, vector in plot.items()}
        finally:
            self.shared.destroy()
            self.shared.remove_circuit()


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    # PySpice requires libngspice.so, which only the development package holds; the library itself has a version.
    if library := ctypes.util.find_library("ngspice"):
        os.environ.setdefault("NGSPICE_LIBRARY_PATH", library)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PySpice 1.5 is older than the language it runs on.
        from PySpice.Spice.NgSpice.Shared import NgSpiceShared

        shared = NgSpiceShared.new_instance()
    # ngspice splits commands at blanks, so the plug-in is loaded under a plain name.
    link = tmp_path_factory.mktemp("plugin") / "bimorph.cm"
    link.symlink_to(plugin())
    shared.exec_command(f"codemodel {link}")
    return Bench(shared)
