"""A run that is asked to stop ends with ngspice and leaves nothing behind."""

import os
import pathlib
import signal
import subprocess
import time

import pytest
from conftest import ROOT, plugin


@pytest.mark.parametrize("asked", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_ngspice_too(tmp_path: pathlib.Path, asked: signal.Signals):
    """A signal to the command alone: status 130, no ngspice left running, no raw file, whole or half."""
    bimorph = os.environ.get("BIMORPH_BIN", str(ROOT / "target/release/bimorph"))
    run = subprocess.Popen(
        [bimorph, "cosim", str(ROOT / "examples/bank/bank.cir"), "--out", str(tmp_path / "bank.raw")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "BIMORPH_CM": str(plugin())},
    )
    children = pathlib.Path(f"/proc/{run.pid}/task/{run.pid}/children")
    deadline = time.monotonic() + 20
    while not (child := children.read_text().split()) and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.2)
    run.send_signal(asked)
    assert run.wait(timeout=20) == 130
    assert not pathlib.Path(f"/proc/{child[0]}").exists()
    assert not list(tmp_path.iterdir())
