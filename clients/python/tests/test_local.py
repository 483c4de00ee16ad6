"""Models in this process are those of a server: the same bits, the same errors, the same interface."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest
from conftest import PLATE

import bimorph
from bimorph import native

pytest.importorskip("bimorph._native", reason="the package was installed without models in process: make wheel")

DT = 1e-7


@pytest.fixture(scope="module")
def here() -> bimorph.Client:
    """This process."""
    return bimorph.local()


@pytest.fixture
def both(here: bimorph.Client, plate: bimorph.Model) -> tuple[bimorph.Model, bimorph.Model]:
    """The plate here and on a server."""
    return here.compile(bimorph.Netlist.text(PLATE, "plate.net")), plate


def pull_in(model: bimorph.Model) -> list[object]:
    """A run through pull-in and back, with what a circuit asks on the way."""
    said: list[object] = []
    with model.session(["m.x", "m.vx"]) as session:
        said += [session.ports, session.signals, session.unknowns, session.port_kinds]
        said.append(session.operating_point({"drive": 3.0}))
        said.append(session.linearize(1e4))
        for k in range(200):
            # past the static pull-in at 5.17 V, and back
            volts = 3.0 + 0.06 * min(k, 200 - k)
            session.trial({"drive": volts + 1.0}, 1e-6)
            said.append(session.step({"drive": volts}, 1e-6))
        said += [session.linearize(1e5), session.noise(1e4), session.t, session.snapshot().states]
    return said


def test_a_pull_in_run_has_the_same_bits(both: tuple[bimorph.Model, bimorph.Model]) -> None:
    """Every reply of a run through pull-in: tokens, currents, charges, derivatives, spectra, and the bytes of the states."""
    here, there = (pull_in(model) for model in both)
    assert repr(here) == repr(there)
    assert len(here) > 200


def test_analyses_have_the_same_bits(both: tuple[bimorph.Model, bimorph.Model]) -> None:
    """Statics, modes, pull-in, frequency response, transients, sweeps."""
    here, there = both
    assert here.id == there.id
    for ask in (
        lambda model: model.static({"drive": 3.0}),
        lambda model: model.modes(2, {"drive": 3.0}),
        lambda model: model.pull_in(30.0),
    ):
        assert repr(ask(here)) == repr(ask(there))
    ac = [m.ac("drive", ["m.x"], start=1e3, stop=1e5, points=11, voltages={"drive": 2.0}).signals["m.x"] for m in both]
    assert np.array_equal(*ac)
    runs = [m.transient(1e-4, ["m.x"], points=51, voltages={"drive": 3.0}).signals["m.x"] for m in both]
    assert np.array_equal(*runs)
    assert runs[0].dtype == np.float64 and runs[0].shape == (51,)


def test_a_sweep_runs_here(here: bimorph.Client, client: bimorph.Client) -> None:
    """The same table, and an interrupted wait leaves the sweep as it is."""
    netlist = bimorph.Netlist.text(PLATE.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u"))
    tables = [
        where.sweep(netlist, {"gap": [1.9e-6, 2e-6, 2.1e-6]}, bimorph.PullIn(30.0, "drive")) for where in (here, client)
    ]
    assert repr(tables[0]) == repr(tables[1])


def test_errors_are_the_same(both: tuple[bimorph.Model, bimorph.Model], here: bimorph.Client, client: bimorph.Client) -> None:
    """Kind, words and fields of what is refused."""

    def refused(ask: object) -> tuple[type, str, object]:
        with pytest.raises(bimorph.BimorphError) as caught:
            ask()  # type: ignore[operator]
        return type(caught.value), str(caught.value), getattr(caught.value, "violations", None)

    wrong = bimorph.Netlist.text("beam2d * [a b] [l=-1]\nnosuch * [a] []\n")
    assert refused(lambda: here.compile(wrong)) == refused(lambda: client.compile(wrong))
    assert refused(lambda: here.compile(wrong))[0] is bimorph.NetlistError
    for ask, kind in (
        (lambda model: model.static({"nosuch": 1.0}), bimorph.InvalidRequest),
        (lambda model: model.pull_in(1.0), bimorph.NoResult),
        (lambda model: model.session(["nosuch"]), bimorph.InvalidRequest),
        (lambda model: model.session().step({"nosuch": 1.0}, DT), bimorph.InvalidRequest),
        (lambda model: model.session().trial({"drive": float("nan")}, DT), bimorph.InvalidRequest),
        (lambda model: model.restore(bimorph.Snapshot(model.id, b"x", None, 0.0, {})), bimorph.InvalidRequest),
    ):
        first, second = (refused(lambda ask=ask, model=model: ask(model)) for model in both)
        assert first == second
        assert first[0] is kind
    with pytest.raises(bimorph.NotFound):
        here.attach("0" * 32)


def test_states_go_on_on_either_side(both: tuple[bimorph.Model, bimorph.Model]) -> None:
    """A snapshot of one is restored by the other, and continues with the same bits; forks and kept sessions are there, too."""
    here, there = both
    with here.session(["m.x"]) as session:
        session.step({"drive": 2.0}, DT)
        snapshot = pickle.loads(pickle.dumps(session.snapshot()))
        expected = session.step({"drive": 3.0}, DT)
    with there.restore(snapshot) as session, here.restore(snapshot) as again, again.fork() as fork:
        assert [s.step({"drive": 3.0}, DT) for s in (session, again, fork)] == [expected] * 3
    kept = here.session(["m.x"], kept=True)
    first = kept.step({"drive": 2.0}, DT)
    kept = kept.resume()
    assert kept.accepted == first and not kept.kept
    kept.close()
    with pytest.raises(bimorph.BimorphError, match="closed"):
        kept.step({"drive": 2.0}, DT)


def test_streams_of_both_kinds_say_the_same(
    server: bimorph.Server, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A session on a server has the same replies and errors by gRPC's own streams and by those of the module."""

    def said() -> str:
        with server.client() as client:
            model = client.compile(bimorph.Netlist.text(PLATE))
            found = repr(pull_in(model))
            with model.session() as session, pytest.raises(bimorph.InvalidRequest) as refused:
                session.trial({"drive": float("inf")}, DT)
            with pytest.raises(bimorph.InvalidRequest) as unknown:
                model.session(["nosuch"])
            return found + str(refused.value) + str(unknown.value)

    with_module = said()
    monkeypatch.setattr(native, "found", lambda: None)
    assert said() == with_module


def in_child(model: bimorph.Model) -> float:
    """What a worker process finds."""
    return model.static({"drive": 3.0}).nodes["m"].x


def test_models_go_to_processes(here: bimorph.Client) -> None:
    """By a fork of a process whose engine runs, and by pickles: each process has models of its own."""
    model = here.compile(bimorph.Netlist.text(PLATE))
    expected = in_child(model)
    for method in ("fork", "spawn"):
        with multiprocessing.get_context(method).Pool(1) as pool:
            assert pool.apply_async(in_child, (model,)).get(60) == expected


def test_others_run_meanwhile(here: bimorph.Client) -> None:
    """While a thread computes, Python's lock is free: this one counts."""
    model = here.compile(bimorph.Netlist.text(PLATE))
    done = threading.Event()

    def compute() -> None:
        model.transient(2e-3, ["m.x"], voltages={"drive": 3.0}, tol=1e-9)
        done.set()

    thread = threading.Thread(target=compute)
    thread.start()
    counted = 0
    while not done.is_set():
        counted += 1
    thread.join()
    assert counted > 100


def test_ctrl_c_stops_a_computation(here: bimorph.Client) -> None:
    """A long run ends with KeyboardInterrupt, and the next one is whole."""
    model = here.compile(bimorph.Netlist.text(PLATE))
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        model.transient(10.0, ["m.x"], voltages={"drive": 3.0}, tol=1e-9)
        time.sleep(10)
    assert model.static({"drive": 3.0}).nodes["m"].x > 0
