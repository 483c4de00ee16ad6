"""Servers, clients, models and errors across processes."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import pickle
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from conftest import PLATE

import bimorph
from bimorph import channel, executors

LONG = 60.0
"""Far longer than anything here takes, on a loaded machine too [s]."""

OWNER = """
import os, signal, sys, time
import bimorph
with bimorph.serve(sys.argv[1]) as server:
    print(server.process.pid, flush=True)
    assert server.client().version()
    {ending}
"""


def run(program: str, ending: str, **options: object) -> subprocess.CompletedProcess[str]:
    """A process that starts a server of its own and ends in a certain way."""
    script = textwrap.dedent(OWNER).format(ending=ending)
    words = [sys.executable, "-c", script, program]
    return subprocess.run(words, stdout=subprocess.PIPE, text=True, timeout=LONG, **options)  # type: ignore[call-overload, no-any-return]


def gone(pid: int) -> bool:
    """Whether a process ends in good time."""
    end = time.monotonic() + LONG / 2
    while time.monotonic() < end:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
                return True
        except FileNotFoundError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks into /proc")
@pytest.mark.parametrize(
    "ending",
    [
        "os.kill(os.getpid(), signal.SIGKILL)",
        "os.kill(os.getpid(), signal.SIGTERM); time.sleep(60)",
        "os._exit(3)",
        "sys.exit(0)",
        "raise RuntimeError",
    ],
)
def test_a_server_ends_with_its_owner(program: str, ending: str) -> None:
    """However the owner ends; and its output ends too, so that `$(…)` does not wait for the server."""
    ended = run(program, ending, stderr=subprocess.DEVNULL)
    assert gone(int(ended.stdout))


def test_a_forked_child_does_not_keep_the_server(program: str) -> None:
    """A worker that outlives the owner has no hold on its server; one that ends first does not stop it."""
    ending = """
    if os.fork() == 0:
        sys.exit(0)
    os.wait()
    assert server.client().version()
    if os.fork() == 0:
        os.close(1)
        time.sleep(20)
        os._exit(0)
    os._exit(0)"""
    ended = run(program, textwrap.indent(textwrap.dedent(ending), "    ").strip(), stderr=subprocess.DEVNULL)
    assert ended.returncode == 0
    assert gone(int(ended.stdout))


def test_an_interrupt_in_the_terminal_leaves_the_server(program: str) -> None:
    """Ctrl-C goes to every process of the terminal's group; the owner may catch it and go on."""
    # where the tests run in the background, interrupts are ignored from the start
    ending = """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        os.killpg(os.getpgrp(), signal.SIGINT)
        time.sleep(30)
    except KeyboardInterrupt:
        assert server.client().version()
        print("continues")"""
    ended = run(program, textwrap.indent(textwrap.dedent(ending), "    ").strip(), start_new_session=True)
    assert ended.stdout.splitlines()[1:] == ["continues"]


def frequency(model: bimorph.Model) -> float:
    """In a worker process."""
    return model.modes(count=1).frequencies_hz[0]


def compiles(client: bimorph.Client, text: str) -> str:
    """In a worker process."""
    return client.compile(bimorph.Netlist.text(text, "bad.net")).id


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_models_and_errors_go_through_pools(method: str, client: bimorph.Client, plate: bimorph.Model) -> None:
    """A model works in a worker as here, and errors arrive as what they were, with all they carry."""
    expected = frequency(plate)
    context = multiprocessing.get_context(method)
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
        assert list(pool.map(frequency, [plate] * 4)) == [expected] * 4
        with pytest.raises(bimorph.NetlistError) as caught:
            pool.submit(compiles, client, PLATE + "nosuch * [m] []\n").result()
        assert any(d.line == 11 for d in caught.value.diagnostics) and caught.value.violations
        # and the pool still works
        assert pool.submit(frequency, plate).result() == expected


def test_every_error_survives_pickling() -> None:
    """Type, text and data."""
    violations = [bimorph.Violation("options.tol", "expected less")]
    diagnostics = [bimorph.Diagnostic("E055", "error", "a.net", 1, 2, "unknown element", "look")]
    errors: list[bimorph.BimorphError] = [
        bimorph.NetlistError("text", violations, diagnostics),
        bimorph.InvalidRequest("text", violations),
        *(kind("text") for kind in (bimorph.NotFound, bimorph.LimitExceeded, bimorph.NoResult)),
        *(kind("text") for kind in (bimorph.StepFailed, bimorph.Unavailable, bimorph.BimorphError)),
    ]
    for error in errors:
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == "text" and vars(again) == vars(error)


def test_a_model_that_the_server_forgot_is_compiled_again(program: str) -> None:
    """Also after the server was started anew at the same address."""
    with bimorph.serve(program) as server:
        model = server.client().compile(bimorph.Netlist.text(PLATE, "plate.net"))
        expected = frequency(model)
        kept = pickle.dumps(model)
    with bimorph.serve(program) as server:
        moved = pickle.loads(kept)
        moved._channel.address = server.address
        assert frequency(moved) == expected
        with moved.session() as session:
            assert session.operating_point({"drive": 1.0}).charges["drive"] != 0.0


def test_clients_of_a_process_share_a_connection(client: bimorph.Client) -> None:
    """A client that is sent with each of a thousand tasks does not use up the connections of the server."""
    client.version()
    sent = pickle.dumps(client)
    clients = [pickle.loads(sent) for _ in range(1000)]
    assert {c.version() for c in clients} == {client.version()}
    assert [a for a, _ in channel._connections if a == client.address] == [client.address]
    assert len({id(c._channel.stub) for c in clients}) == 1


THREADS = """
import sys
from concurrent.futures import ThreadPoolExecutor
import bimorph
with ThreadPoolExecutor(int(sys.argv[1])) as pool:
    netlist = bimorph.Netlist.text(sys.argv[2])
    table = bimorph.sweep_on(pool, netlist, {"k": [1.0 + 0.01 * i for i in range(64)]}, bimorph.Modes(count=1), shards=8, retries=0)
print(table)
"""


@pytest.mark.parametrize("threads", [1, 4])
def test_threads_share_the_server_of_their_process(program: str, monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    """A sweep over a pool of threads needs no second attempt, and the process ends as others do, its server with it."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    words = [sys.executable, "-c", THREADS, str(threads), PLATE]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=LONG)
    assert (ended.returncode, ended.stdout) == (0, "<Table of f1 over k: 64 points>\n"), ended.stderr


def test_a_forked_child_has_a_server_of_its_own(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forked where the parent's was in use: the parent's continues, and that of the child is another one."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    parent = executors._own()
    end, child_end = multiprocessing.Pipe()
    child = multiprocessing.get_context("fork").Process(target=lambda: child_end.send(executors._own().address))
    child.start()
    assert end.poll(LONG) and end.recv() != parent.address
    child.join(LONG)
    assert child.exitcode == 0
    assert executors._own() is parent and parent.client().version()
    parent.process.kill()
    parent.process.wait()
    assert executors._own().client().version()


def test_typos_in_sweeps_raise(client: bimorph.Client) -> None:
    """A parameter or an output that does not exist is an error, not a table full of reasons."""
    netlist = bimorph.Netlist.text(PLATE, "plate.net")
    with pytest.raises(bimorph.InvalidRequest, match="kk"):
        client.sweep(netlist, {"kk": [1.0, 2.0]}, bimorph.Modes(count=1))
    with pytest.raises(bimorph.InvalidRequest, match="m.xx"):
        client.sweep(netlist, {"k": [1.0, 2.0]}, bimorph.Static(outputs=["m.x", "m.xx"]))
    with pytest.raises(KeyError, match="nosuch"):
        client.sweep(netlist, {"k": [1.0, 2.0]}, bimorph.Static(outputs=["m.x"])).column("nosuch")
