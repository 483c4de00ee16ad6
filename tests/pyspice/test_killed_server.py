"""A server that is killed in mid-run ends the simulation at once, with one error and no waveforms."""

import os
import pathlib
import subprocess
import time

from conftest import ROOT, plugin

DECK = ROOT / "examples/bank/bank.cir"


def test_killed_server_stops_the_simulation(tmp_path: pathlib.Path):
    """SIGKILL after the circuit is under way: status 1, the instance and the address named, no raw file, nothing called done."""
    bimorph = os.environ.get("BIMORPH_BIN", str(ROOT / "target/release/bimorph"))
    address, raw = f"unix://{tmp_path}/s.sock", tmp_path / "bank.raw"
    server = subprocess.Popen([bimorph, "serve", "--listen", address], stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + 20
        while not (tmp_path / "s.sock").exists() and time.monotonic() < deadline:
            time.sleep(0.02)
        run = subprocess.Popen(
            [bimorph, "cosim", str(DECK), "--remote", address, "--out", str(raw)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "BIMORPH_CM": str(plugin())},
        )
        # the deck takes seconds; the session is open as soon as the server has spent some time on it
        stat = pathlib.Path(f"/proc/{server.pid}/stat")
        busy = int(stat.read_text().split()[13]) + 10
        while int(stat.read_text().split()[13]) < busy and time.monotonic() < deadline:
            time.sleep(0.02)
        assert run.poll() is None, "the run ended before the server could be killed"
        server.kill()
        out, err = run.communicate(timeout=30)
    finally:
        server.kill()
        server.wait()
    assert run.returncode == 1, (out, err)
    errors = [line for line in err.splitlines() if line.startswith("error:")]
    assert len(errors) == 1, err
    assert "a1" in errors[0].lower() and address in errors[0], errors
    assert not raw.exists() and not list(tmp_path.glob("*.raw*"))
    assert "No. of Data Rows" not in out
