"""The package for asyncio: what lasts is awaited, several at once, and a task that is cancelled stops its call."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest
from conftest import PLATE

import bimorph
from bimorph import aio

NET = bimorph.Netlist.text(PLATE.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u"))
DT = 1e-7


def native() -> bool:
    """Whether the package was installed with models in process."""
    try:
        import bimorph._native  # noqa: F401
    except ImportError:
        return False
    return True


@pytest.fixture(params=["remote", pytest.param("local", marks=pytest.mark.skipif(not native(), reason="make wheel"))])
def both(request: pytest.FixtureRequest, server: bimorph.Server) -> aio.Client:
    """A client of a server, and one of this process."""
    return aio.local() if request.param == "local" else aio.Client(server.address)


def run(test: Coroutine[Any, Any, None]) -> None:
    """Runs a test to its end, within a bound."""
    asyncio.run(asyncio.wait_for(test, 60.0))


def test_calls_are_those_of_the_package(both: aio.Client, client: bimorph.Client) -> None:
    """Analyses, sessions and sweeps give what the same calls without asyncio give; many run at once."""
    plate = client.compile(NET)

    async def test() -> None:
        model = await both.compile(NET)
        assert model.sync.id == plate.id
        volts = [0.1 * k for k in range(20)]
        found = await asyncio.gather(*(model.static({"drive": v}) for v in volts))
        assert [repr(one) for one in found] == [repr(plate.static({"drive": v})) for v in volts]
        run = await model.transient(1e-4, ["m.x"], points=11, voltages={"drive": 3.0})
        assert (run.signals["m.x"] == plate.transient(1e-4, ["m.x"], points=11, voltages={"drive": 3.0}).signals["m.x"]).all()
        async with await model.session(["m.x"]) as session:
            replies = [await session.step({"drive": 1.0 + k}, dt=DT) for k in range(4)]
            assert session.t == pytest.approx(4 * DT)
        with plate.session(["m.x"]) as same:
            assert replies == [same.step({"drive": 1.0 + k}, DT) for k in range(4)]
        with pytest.raises(bimorph.InvalidRequest):
            await model.static({"nosuch": 1.0})

    run(test())


def test_a_sweep_is_iterated_over(both: aio.Client, client: bimorph.Client) -> None:
    """Rows come one by one, all of them and in order; while it runs its status is watched."""
    gaps = [1.5e-6 + 1e-8 * k for k in range(100)]
    table = client.sweep(NET, {"gap": gaps}, bimorph.PullIn(30.0, "drive"))

    async def test() -> None:
        async with await both.submit(NET, {"gap": gaps}, bimorph.PullIn(30.0, "drive")) as sweep:
            states = [status async for status in sweep.watch()]
            assert (states[-1].state, states[-1].done) == ("done", 100)
            rows = [row async for row in sweep]
            assert rows == table.rows
            async for row in sweep:
                assert row.point == 0
                break
        assert repr(await both.sweep(NET, {"gap": gaps}, bimorph.PullIn(30.0, "drive"))) == repr(table)

    run(test())




def test_a_task_that_is_cancelled_stops_its_call(both: aio.Client) -> None:
    """A long run and a long static solution end on the other side as well: the server's places are free for what comes next."""

    async def test() -> None:
        model = await both.compile(NET)
        for _ in range(8):
            runs = [
                asyncio.create_task(model.transient(100.0, ["m.x"], points=2, voltages={"drive": 3.0}, tol=1e-9))
                for _ in range(8)
            ]
            await asyncio.sleep(0.05)
            for task in runs:
                task.cancel()
            done = await asyncio.gather(*runs, return_exceptions=True)
            assert all(isinstance(one, asyncio.CancelledError) for one in done)
        # each of those would have taken minutes
        assert (await model.static({"drive": 3.0})).nodes["m"].x > 0

    run(test())


def test_the_loop_goes_on_meanwhile(both: aio.Client) -> None:
    """While a run is awaited, other tasks have their turn."""

    async def test() -> None:
        model = await both.compile(NET)
        task = asyncio.create_task(model.transient(2e-3, ["m.x"], voltages={"drive": 3.0}, tol=1e-9))
        turns = 0
        while not task.done():
            await asyncio.sleep(0)
            turns += 1
        assert turns > 10
        await task

    run(test())
