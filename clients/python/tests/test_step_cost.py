"""The script that measures steps says what is missing, and measures the rest."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from conftest import ROOT

import bimorph
from bimorph import native

SCRIPT = ROOT / "scripts" / "step-cost-python"
WITHOUT = "import sys, runpy; sys.modules['bimorph._native'] = None; sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
SMALL = ["40", "--run", "64", "--rows", "10"]

pytestmark = pytest.mark.skipif(not SCRIPT.is_file(), reason="the tests are run without the repository")


def run(words: list[str], program: str) -> subprocess.CompletedProcess[str]:
    """The script in another process."""
    path = os.path.dirname(os.path.dirname(bimorph.__file__))
    environment = {**os.environ, "BIMORPH_BIN": program, "PYTHONPATH": os.pathsep.join(filter(None, [path, os.environ.get("PYTHONPATH", "")]))}
    return subprocess.run([sys.executable, *words], env=environment, capture_output=True, text=True, timeout=120)


def test_steps_are_measured_without_the_native_module(program: str) -> None:
    """A fresh checkout has none: the commands that build it are printed, and steps, runs and rows on a server are measured."""
    done = run(["-c", WITHOUT, str(SCRIPT), *SMALL], program)
    assert (done.returncode, done.stderr) == (0, "")
    assert "in process   not measured: this package has no models in process" in done.stdout
    assert "cargo build --release --manifest-path clients/python/native/Cargo.toml" in done.stdout and "_native.abi3.so" in done.stdout
    for name in ("on a server ", "run on a server", "batch on a server", "row of a sweep"):
        assert f"\n{name}" in done.stdout, name


def test_steps_are_measured_with_it(program: str) -> None:
    """Where it is installed, steps, runs and batches in process come first."""
    if native.found() is None:
        pytest.skip("the module that is not Python is not installed")
    done = run([str(SCRIPT), *SMALL], program)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.startswith("in process ") and "not measured" not in done.stdout


def test_a_missing_package_and_a_missing_program_are_named(program: str) -> None:
    """One line with the way to get them, and no traceback; an argument that is no number of steps is a usage error."""
    bare = subprocess.run([sys.executable, "-I", "-S", str(SCRIPT)], capture_output=True, text=True, timeout=60)
    assert bare.returncode == 1 and "run `scripts/setup python build`" in bare.stderr and "Traceback" not in bare.stderr
    lost = run([str(SCRIPT), *SMALL], "/nosuch/bimorph")
    assert lost.returncode == 1 and "scripts/setup build" in lost.stderr and "Traceback" not in lost.stderr
    assert run([str(SCRIPT), "0"], program).returncode == 2
