"""Servers, sessions and sweeps from their beginning to their end: without a block, in numbers, and over failures."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import PLATE
from test_kept import DT, drive, start

import bimorph
from bimorph import native

NET = bimorph.Netlist.text(PLATE, "plate.net")

CELLS = """
import sys
import bimorph
server = {started}
client = server.client()
assert client.version()
model = client.compile(bimorph.Netlist.text(sys.argv[2]))
session = model.session()
session.operating_point({{"drive": 1.0}})
print(server.process.pid, server.address, flush=True)
"""


@pytest.mark.parametrize("started", ["bimorph.serve(sys.argv[1])", "bimorph.Server(sys.argv[1]).start()", "bimorph.serve(sys.argv[1]).__enter__()"])
def test_a_server_over_cells_ends_with_the_interpreter(program: str, started: str) -> None:
    """A server that was not closed, with an open session, as in a notebook: the interpreter ends as others do, and the server before it."""
    words = [sys.executable, "-c", CELLS.format(started=started), program, PLATE]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stderr) == (0, "")
    pid, address = ended.stdout.split()
    assert not Path(address.removeprefix("unix://")).parent.exists()
    assert not Path(f"/proc/{pid}").exists()


def test_a_server_starts_and_closes(program: str) -> None:
    """Each as often as wanted; a closed one has no address, and one that has died is started anew."""
    server = bimorph.Server(program)
    with pytest.raises(bimorph.BimorphError, match="does not run"):
        server.client()
    with server.start() as same:
        assert same is server and server.start() is server
        first = server.process
        assert server.client().version() == bimorph.__version__
        first.kill()
        first.wait()
        assert server.start().client().version() and server.process is not first
    server.close()
    server.close()
    with pytest.raises(bimorph.BimorphError, match="does not run"):
        _ = server.address
    assert server.process.poll() is not None and repr(server) == "<Server, not running>"


@pytest.mark.parametrize("is_native", [True, False])
def test_sessions_beyond_one_connection(program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_native: bool) -> None:
    """A server takes five streams on a connection: more sessions go over further ones, calls go on beside them, and beyond the sessions of
    the server the next one is refused. Closed sessions make room."""
    if is_native and native.found() is None:
        pytest.skip("the module that is not Python is not installed")
    if not is_native:
        monkeypatch.setattr(native, "found", lambda: None)
    process = start(program, tmp_path, "--limit", "streams_per_connection=5", "--max-sessions", "23")
    try:
        client = bimorph.Client(f"unix://{tmp_path}/s", timeout=10.0)
        model = client.compile(NET)
        held = [model.session(["m.x"], timeout=10.0) for _ in range(23)]
        with pytest.raises(bimorph.LimitExceeded, match="sessions"):
            model.session(timeout=10.0)
        assert client.version() and model.modes(1).frequencies_hz
        assert len({session.step({"drive": 1.0}, 1e-7).outputs["m.x"] for session in held}) == 1
        for session in held:
            session.close()
        places = client._channel._connection.native_places if is_native else client._channel._connection.places  # type: ignore[union-attr]
        until = time.monotonic() + 10.0
        while sum(places._taken) and time.monotonic() < until:
            time.sleep(0.01)
        assert sum(places._taken) == 0 and len(places._taken) <= 7
    finally:
        process.kill()
        process.wait()


class Remembering:
    """An executor as Dask's client: a task of the same function and arguments is the same task, unless it is said that it is not pure."""

    def __init__(self) -> None:
        self.tasks: dict[str, Callable[[], Any]] = {}
        self.failing = {(1, 3): 2}

    def submit(self, task: Callable[..., Any], /, *arguments: Any, pure: bool = True) -> Any:
        """A future."""
        key = repr(arguments)
        if not pure or key not in self.tasks:
            shard = arguments[6]
            if self.failing.get(shard, 0) > 0:
                self.failing[shard] -= 1
                self.tasks[key] = self._fails
            else:
                found = task(*arguments)
                self.tasks[key] = lambda: found
        return Future(self.tasks[key])

    @staticmethod
    def _fails() -> Any:
        raise bimorph.Unavailable("the server died")


class Future:
    """What a task gives."""

    def __init__(self, result: Callable[[], Any]) -> None:
        self.result = result


def test_a_part_that_failed_is_another_task(client: bimorph.Client) -> None:
    """A part whose server dies twice is submitted three times, each time as a new task, also where tasks are known by their arguments."""
    values = {"k": [1.0, 1.1, 1.2, 1.3]}
    whole = client.sweep(NET, values, bimorph.Modes(1))
    executor = Remembering()
    assert bimorph.sweep_on(executor, NET, values, bimorph.Modes(1), shards=3, server=client.address) == whole
    assert executor.failing == {(1, 3): 0}
    with pytest.raises(bimorph.Unavailable):
        bimorph.sweep_on(Remembering(), NET, values, bimorph.Modes(1), shards=3, server=client.address, retries=1)


def test_a_sweep_without_one_result_raises(client: bimorph.Client) -> None:
    """With the reasons, here and on a server; a part of a sweep may lack results, and one result is enough."""
    # a plate that pulls in at 1.6 V with 0.1 N/m, at 5.2 V with 1 N/m: (8/27·k·g³/(ε·A))^½
    pull_in = bimorph.PullIn(max_v=2.0)
    for sweep in (
        lambda: client.sweep(NET, {"k": [1.0, 2.0]}, pull_in),
        lambda: bimorph.sweep_on(Remembering(), NET, {"k": [1.0, 2.0]}, pull_in, shards=2, server=client.address),
        lambda: client.attach(client.submit(NET, {"k": [1.0, 2.0]}, pull_in).id).wait(),
    ):
        with pytest.raises(bimorph.NoResult, match="none of the 2 points of the sweep has a result; point 0: .*2") as caught:
            sweep()
        assert [row.point for row in caught.value.table.rows] == [0, 1] and all(row.error for row in caught.value.table.rows)
    assert client.sweep(NET, {"k": [1.0, 2.0]}, pull_in, shard=(1, 2)).rows[0].error
    found = client.sweep(NET, {"k": [1.0, 0.1]}, pull_in)
    assert [bool(row.error) for row in found.rows] == [True, False]
    parts = bimorph.sweep_on(Remembering(), NET, {"k": [1.0, 0.1]}, pull_in, shards=2, server=client.address)
    assert parts == found


def test_a_server_that_is_away_is_waited_for(program: str, tmp_path: Path) -> None:
    """For five seconds, longer than the first attempts last: a kept session resumes, and a sweep has its table, with the bits of those that
    were not interrupted."""
    process = start(program, tmp_path)
    held = [process]

    def later() -> None:
        time.sleep(5.0)
        held.append(start(program, tmp_path))

    try:
        client = bimorph.Client(f"unix://{tmp_path}/s", 60.0)
        with client.compile(NET).session(["m.x"]) as whole:
            expected = [whole.step(drive(k), DT) for k in range(2)]
        session = client.compile(NET).session(["m.x"], kept=True)
        assert session.step(drive(0), DT) == expected[0]
        axis = {"k": [1.0 + 0.001 * k for k in range(50)]}
        table = client.sweep(NET, axis, bimorph.Modes(1))
        sweep = client.submit(NET, axis, bimorph.Modes(1))
        process.kill()
        process.wait()
        thread = threading.Thread(target=later)
        thread.start()
        begun = time.monotonic()
        session = session.resume()
        assert time.monotonic() - begun > 4.0
        assert session.step(drive(1), DT) == expected[1]
        assert sweep.wait() == table
        thread.join()
    finally:
        for one in held:
            one.kill()
            one.wait()


def test_a_server_that_never_was_is_given_up(tmp_path: Path) -> None:
    """An address without a server is not waited for until the time-out of calls; a resume ends at its own."""
    client = bimorph.Client(f"unix://{tmp_path}/nosuch", timeout=600.0)
    begun = time.monotonic()
    with pytest.raises(bimorph.Unavailable):
        client.submit(NET, {"k": [1.0]}, bimorph.Modes(1))
    with pytest.raises(bimorph.Unavailable):
        client.resume(bimorph.Ticket("model", "session", None, 0.0, {}), timeout=1.0)
    assert time.monotonic() - begun < 30.0


def test_the_time_of_a_session_is_exact(plate: bimorph.Model) -> None:
    """Steps of a float32 are those of the float64 of the same value: 1000 of 1e-6 s (float32) have the time 1000·float(float32(1e-6)), to rounding."""
    import numpy as np

    step = np.float32(1e-6)
    with plate.session(["m.x"]) as session, plate.session(["m.x"]) as other:
        for _ in range(1000):
            reply, expected = session.step({"drive": np.float32(1.5)}, step), other.step({"drive": 1.5}, float(step))
        assert type(session.t) is float and abs(session.t - 1000 * float(step)) < 1e-12 * session.t
        assert reply == expected


def test_shared_sweeps(client: bimorph.Client) -> None:
    """Shared is what was submitted as shared, with the same points and `release_after`; a sweep of one's own is not."""
    values, submitted = {"k": [1.0, 3.0]}, contextlib.ExitStack()
    with submitted:
        own = submitted.enter_context(client.submit(NET, values, bimorph.Modes(1)))
        shared = client.submit(NET, values, bimorph.Modes(1), share=True)
        submitted.callback(shared.delete)
        released = client.submit(NET, values, bimorph.Modes(1), share=True, release_after=600.0)
        submitted.callback(released.delete)
        assert len({own.id, shared.id, released.id}) == 3
        assert client.submit(NET, values, bimorph.Modes(1), share=True).id == shared.id


RAW = re.compile(r"last error|connect failed|Stream removed|h2 protocol|grpc|StatusCode|<_|addr:|ipv4:|traceback", re.IGNORECASE)
"""Words of gRPC and of its status codes."""


@pytest.mark.parametrize("is_native", [True, False])
@pytest.mark.parametrize("ending", ["kill", "terminate", "close"])
def test_messages_after_the_end_of_a_server(program: str, monkeypatch: pytest.MonkeyPatch, ending: str, is_native: bool) -> None:
    """Whichever call finds it gone: one sentence with what has happened, the server and a remedy, without words of gRPC."""
    if is_native and native.found() is None:
        pytest.skip("the module that is not Python is not installed")
    if not is_native:
        monkeypatch.setattr(native, "found", lambda: None)
    server = bimorph.Server(program).start()
    address, client = server.address, server.client()
    model = client.compile(NET)
    session, kept = model.session(["m.x"], timeout=5.0), model.session(kept=True, timeout=1.0)
    batch = bimorph.Batch.of([model] * 2)
    sweep = client.submit(NET, {"k": [1.0]}, bimorph.Modes(1))
    sweep.wait()
    if ending == "close":
        server.close()
    else:
        getattr(server.process, ending)()
        server.process.wait()
        with pytest.raises(bimorph.Unavailable, match=r"its process has ended (by signal 9|with exit status 0); start\(\) starts it again"):
            server.client()
    client._channel.reconnect = 0.5
    kept._timeout = 0.5
    calls: list[Callable[[], Any]] = [
        lambda: session.step({"drive": 1.0}, 1e-6),
        lambda: session.step({"drive": 1.0}, 1e-6),
        lambda: session.run([1e-6], {"drive": 1.0}),
        session.snapshot,
        session.fork,
        kept.resume,
        lambda: batch.run([1e-6], {}),
        lambda: batch.operating_point({}),
        lambda: model.modes(1),
        lambda: model.transient(1e-6, ["m.x"], points=3),
        model.session,
        lambda: client.compile(NET),
        sweep.wait,
        sweep.status,
        client.version,
    ]
    for call in calls:
        with pytest.raises(bimorph.Unavailable) as caught:
            call()
        text = str(caught.value)
        assert text.startswith(f"server {address}: ") and not RAW.search(text), text
        assert re.search(r"; (start one there, or check the address|connect again when|open another session)", text), text
    server.close()


def test_messages_of_a_closed_session(plate: bimorph.Model) -> None:
    """Every call of a session that was closed says so, names the model and the server, and how to open another one."""
    session = plate.session(["m.x"])
    session.operating_point({"drive": 1.0})
    session.close()
    calls: list[Callable[[], Any]] = [
        lambda: session.step({"drive": 1.0}, 1e-6),
        lambda: session.trial({"drive": 1.0}),
        lambda: session.run([1e-6], {}),
        lambda: session.operating_point({}),
        lambda: session.linearize(1e3),
        session.snapshot,
        session.fork,
        session.ticket,
        lambda: bimorph.Batch([session]).run([1e-6], {}),
    ]
    for call in calls:
        with pytest.raises(bimorph.BimorphError, match=r"^this session of model \w{8} on server unix:.* is closed; open another one with Model.session\(\)$"):
            call()


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("unix:///nosuch/s", "no server answers at this address (no such file or directory); start one there, or check the address"),
        ("localhost:1", "no server answers at this address (connection refused); start one there, or check the address"),
        ("nosuch.invalid:1", "the name of the host is unknown; check the address"),
    ],
)
def test_messages_of_an_address_without_a_server(address: str, message: str) -> None:
    """The reason of the system, and the remedy."""
    with pytest.raises(bimorph.Unavailable) as caught:
        bimorph.Client(address, timeout=10.0).version()
    assert str(caught.value) == f"server {address}: {message}"
