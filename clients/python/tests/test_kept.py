"""Sessions that outlive their server: ``serve --state-dir``."""

from __future__ import annotations

import itertools
import pickle
import random
import signal
import struct
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


def kept_one(client: bimorph.Client) -> tuple[bimorph.Session, bimorph.TrialReply]:
    """A kept session with one accepted state, and that state."""
    session = client.compile(bimorph.Netlist.text(PLATE)).session(["m.x"], kept=True)
    return session, session.step(drive(0), DT)


def test_a_resume_that_fails_takes_nothing_away(program: str, tmp_path: Path) -> None:
    """A server that has no room for a session refuses it, and has it when there is room."""
    process = start(program, tmp_path)
    address = f"unix://{tmp_path}/s"
    session, last = kept_one(bimorph.Client(address))
    ticket = session.ticket()
    process.kill()
    process.wait()
    process = start(program, tmp_path, "--max-sessions", "1")
    try:
        client = bimorph.Client(address)
        with client.compile(bimorph.Netlist.text(PLATE)).session():
            with pytest.raises(bimorph.LimitExceeded, match="sessions"):
                client.resume(ticket)
            with pytest.raises(bimorph.LimitExceeded, match="sessions"):
                session.resume()
        for _ in range(1000):
            # the server may see the end of the other stream a moment later
            try:
                again = session.resume()
                break
            except bimorph.LimitExceeded:
                continue
        else:
            pytest.fail("there is no room again")
        assert again.accepted == last
        assert again.step(drive(1), DT).token
    finally:
        process.kill()
        process.wait()


def test_a_call_that_takes_too_long_takes_nothing_away(program: str, tmp_path: Path) -> None:
    """A server that is stopped does not answer; when it continues, so does the session, and each step is in it once."""
    process = start(program, tmp_path)
    try:
        client = bimorph.Client(f"unix://{tmp_path}/s", 20.0)
        model = client.compile(bimorph.Netlist.text(PLATE))
        with model.session(["m.x"]) as whole:
            expected = [whole.step(drive(k), DT) for k in range(3)]
        session = model.session(["m.x"], kept=True)
        assert session.step(drive(0), DT) == expected[0]
        session._line.timeout = 0.3
        process.send_signal(signal.SIGSTOP)
        with pytest.raises(bimorph.Unavailable, match="no answer within"):
            session.step(drive(1), DT)
        process.send_signal(signal.SIGCONT)
        session = session.resume()
        assert [session.step(drive(k), DT) for k in (1, 2)] == expected[1:]
    finally:
        process.kill()
        process.wait()


def fnv(data: bytes) -> bytes:
    """FNV-1a of 128 bits (Fowler, Noll, Vo), little-endian."""
    value = 0x6C62272E07BB014262B821756295C58D
    for byte in data:
        value = ((value ^ byte) * 0x0000000001000000000000000000013B) % (1 << 128)
    return value.to_bytes(16, "little")


def of_another_version(data: bytes) -> bytes:
    """A file of states as another version would have written it: head, checksum, four words, and the envelope, whose body begins
    with the version."""
    words, sealed = data[32:64], data[64 : 64 + struct.unpack("<Q", data[56:64])[0]]
    body = sealed[33:]
    body = bytes([5]) + b"9.9.9" + body[1 + body[0] :]
    sealed = sealed[:17] + fnv(body) + body
    rest = words[:24] + struct.pack("<Q", len(sealed)) + sealed
    return data[:16] + fnv(rest) + rest


def test_another_version_is_no_result(program: str, tmp_path: Path) -> None:
    """States of another version are refused as such, and stay."""
    process = start(program, tmp_path)
    address = f"unix://{tmp_path}/s"
    session, _ = kept_one(bimorph.Client(address))
    process.kill()
    process.wait()
    files = list((tmp_path / "states" / "sessions").iterdir())
    for path in files:
        path.write_bytes(of_another_version(path.read_bytes()))
    process = start(program, tmp_path)
    try:
        for resume in (session.resume, lambda: bimorph.Client(address).resume(session.ticket())):
            with pytest.raises(bimorph.NoResult, match="version 9.9.9"):
                resume()
        assert set((tmp_path / "states" / "sessions").iterdir()) == set(files)
    finally:
        process.kill()
        process.wait()
