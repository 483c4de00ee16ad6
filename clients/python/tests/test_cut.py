"""A network that fails: nothing hangs, nothing is lost, and nothing counts as complete that is not."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

import pytest
from conftest import PLATE
from cut import Cut, cut

import bimorph

DT = 1e-7


@pytest.fixture
def way(program: str) -> Iterator[Cut]:
    """A way to a server over TCP."""
    words = [program, "serve", "--listen", "127.0.0.1:0", "--while-stdin"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        port = int(process.stderr.readline().rsplit(":", 1)[1])
        with cut(("127.0.0.1", port)) as way:
            yield way
        process.kill()


def drive(step: int) -> dict[str, float]:
    """What is given in one step [V]."""
    return {"drive": 1.0 + step % 7}


@pytest.mark.parametrize("kind", ["silence", "reset"])
def test_a_session_goes_on(way: Cut, kind: str) -> None:
    """A step that is cut off raises, long before its own time is over; the session resumes with the bits of one that was not cut."""
    model = bimorph.Client(way.address).compile(bimorph.Netlist.text(PLATE))
    with model.session(["m.x"]) as whole:
        expected = [whole.step(drive(k), DT) for k in range(12)]
    session = model.session(["m.x"], kept=True, timeout=600.0)
    for k in range(12):
        if k == 5:
            getattr(way, kind)()
            with pytest.raises(bimorph.Unavailable):
                session.step(drive(k), DT)
            session = session.resume()
            assert session.accepted == expected[k - 1]
        assert session.step(drive(k), DT) == expected[k]
    session.close()


@pytest.mark.parametrize("kind", ["silence", "reset"])
def test_a_sweep_goes_on(way: Cut, kind: str) -> None:
    """A client that waits for a sweep gets its whole table, whatever happened to the connection meanwhile."""
    client = bimorph.Client(way.address, 600.0)
    text = PLATE.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u")
    gaps = [1.5e-6 + 1e-9 * k for k in range(400)]
    sweep = client.submit(bimorph.Netlist.text(text), {"gap": gaps}, bimorph.PullIn(30.0, "drive"))
    cuts = 0

    def progress(done: int, points: int) -> None:
        nonlocal cuts
        if cuts < 2:
            cuts += 1
            getattr(way, kind)()

    table = sweep.wait(progress)
    assert cuts > 0
    assert [row.point for row in table.rows] == list(range(400))
    assert all(row.results["pull_in"] > 0 for row in table.rows)
    sweep.delete()


@pytest.mark.parametrize("kind", ["silence", "reset"])
def test_a_sweep_ends(way: Cut, kind: str) -> None:
    """A client ends a sweep even over a broken connection; deleting what is gone raises, unless only the answer was lost."""
    client = bimorph.Client(way.address, 600.0)
    text = PLATE.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u")
    gaps = [1.5e-6 + 1e-12 * k for k in range(100_000)]
    sweep = client.submit(bimorph.Netlist.text(text), {"gap": gaps}, bimorph.PullIn(30.0, "drive"))
    getattr(way, kind)()
    sweep.cancel()
    assert list(sweep.watch())[-1].state == "cancelled"
    getattr(way, kind)()
    sweep.delete()
    with pytest.raises(bimorph.NotFound):
        sweep.delete()


def test_a_run_that_is_cut_off_is_no_run(way: Cut) -> None:
    """A transient whose connection goes silent raises; it does not wait for ever, nor return what it has."""
    model = bimorph.Client(way.address, 600.0).compile(bimorph.Netlist.text(PLATE))

    def progress(done: float) -> None:
        way.silence()

    with pytest.raises(bimorph.Unavailable):
        model.transient(1.0, ["m.x"], voltages={"drive": 3.0}, progress=progress, points=100_000, tol=1e-9)
