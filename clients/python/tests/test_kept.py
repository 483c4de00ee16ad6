"""Sessions that outlive their server: ``serve --state-dir``."""

from __future__ import annotations

import itertools
import pickle
import random
import subprocess
from pathlib import Path

import pytest
from conftest import PLATE

import bimorph

DT = 1e-7


def start(program: str, folder: Path, *more: str) -> subprocess.Popen[bytes]:
    """A server on a socket in ``folder``, with its states beside it."""
    words = [program, "serve", "--listen", f"unix://{folder}/s", "--state-dir", str(folder / "states"), *more]
    process = subprocess.Popen(words, stderr=subprocess.PIPE)
    assert process.stderr is not None
    assert process.stderr.readline().startswith(b"listening on")
    return process


def drive(step: int) -> dict[str, float]:
    """What is given in one step [V]."""
    return {"drive": 1.0 + step % 7}


def test_a_killed_server_loses_no_accepted_state(program: str, tmp_path: Path) -> None:
    """Three kills at random moments: every accepted state is there again, and the run has the bits of one without kills."""
    chance, kills = random.Random(12), 3
    process = start(program, tmp_path)
    try:
        client = bimorph.Client(f"unix://{tmp_path}/s", 20.0)
        model = client.compile(bimorph.Netlist.text(PLATE))
        with model.session(["m.x"]) as whole:
            expected = [whole.step(drive(k), DT) for k in range(40)]
        session = model.session(["m.x"], kept=True)
        assert session.kept
        moments = sorted(chance.sample(range(1, 39), kills))
        for k in range(40):
            if k in moments:
                process.kill()
                process.wait()
                process = start(program, tmp_path)
                with pytest.raises(bimorph.BimorphError):
                    session.step(drive(k), DT)
                session = session.resume()
                assert session.accepted == expected[k - 1]
            assert session.step(drive(k), DT) == expected[k]
        session.close()
        assert not list((tmp_path / "states" / "sessions").iterdir())
    finally:
        process.kill()
        process.wait()


def test_a_ticket_goes_on_elsewhere(program: str, tmp_path: Path) -> None:
    """After a clean stop, too: from a ticket, by another client, whose server was never given the netlist."""
    process = start(program, tmp_path)
    address = f"unix://{tmp_path}/s"
    model = bimorph.Client(address).compile(bimorph.Netlist.text(PLATE))
    session = model.session(["m.x"], kept=True)
    for k in itertools.count(0):
        last = session.step(drive(k), DT)
        if k == 5:
            break
    ticket = pickle.loads(pickle.dumps(session.ticket()))
    process.terminate()
    assert process.wait(20) == 0
    process = start(program, tmp_path, "--state-unsynced")
    try:
        again = bimorph.Client(address).resume(ticket)
        assert again.accepted == last
        assert again.step(drive(6), DT).token
        again.close()
        with pytest.raises(bimorph.NotFound):
            bimorph.Client(address).resume(ticket)
    finally:
        process.kill()
        process.wait()


def test_a_folder_that_is_full(program: str, tmp_path: Path) -> None:
    """A session that cannot be kept does not open, and says which limit it met."""
    process = start(program, tmp_path, "--limit", "state_bytes=600")
    try:
        model = bimorph.Client(f"unix://{tmp_path}/s").compile(bimorph.Netlist.text(PLATE))
        with pytest.raises(bimorph.LimitExceeded, match="state_bytes"):
            session = model.session(kept=True)
            for k in range(3):
                session.step(drive(k), DT)
    finally:
        process.kill()
        process.wait()


def test_without_a_folder_nothing_is_kept(plate: bimorph.Model) -> None:
    """A kept session still outlives its connection, and says that it does not outlive the server."""
    session = plate.session(kept=True)
    assert not session.kept
    first = session.step(drive(0), DT)
    session = session.resume()
    assert session.accepted == first
    session.close()
