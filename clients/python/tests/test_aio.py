"""The package for asyncio: what lasts is awaited, several at once, and a task that is cancelled stops its call."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

import pytest
from conftest import PLATE

import bimorph
from bimorph import aio
from bimorph.session import opened_just_now, resumed
from bimorph.v1 import device_pb2

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
    """Rows come one by one, all of them, from any one on; while it runs its status is watched."""
    gaps = [1.5e-6 + 1e-8 * k for k in range(100)]
    table = client.sweep(NET, {"gap": gaps}, bimorph.PullIn(30.0, "drive"))

    async def test() -> None:
        async with await both.submit(NET, {"gap": gaps}, bimorph.PullIn(30.0, "drive")) as sweep:
            states = [status async for status in sweep.watch()]
            assert (states[-1].state, states[-1].done) == ("done", 100)
            rows = [row async for row in sweep]
            assert sorted(rows, key=lambda row: row.point) == table.rows
            assert [row async for row in sweep.rows(90)] == rows[90:]
            async for row in sweep:
                assert row == rows[0]
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


def test_a_run_along_waveforms_stops(both: aio.Client) -> None:
    """What is computed step by step ends with its task, which would have gone on for minutes, between two steps or in the middle of one; the
    session of the test itself continues from where it was."""

    async def test() -> None:
        model = await both.compile(bimorph.Netlist.text(PLATE.replace("gap=2u", "gap=2u restitution=1"), "plate.net"))
        async with await model.session(["m.x"]) as session:
            await session.operating_point({"drive": 1.0})
            for points in (10**6, 2):
                before = set(threading.enumerate())
                # a plate that is pulled in and bounces without loss needs short steps
                wave = {"drive": ([0.0, 1e-6], [0.0, 12.0])}
                task = asyncio.create_task(model.transient(10.0, ["m.x"], points=points, inputs=wave, estimate=False))
                await asyncio.sleep(0.2)
                ours = set(threading.enumerate()) - before
                assert ours and not task.done()
                step = asyncio.create_task(session.step({"drive": 12.0}, dt=10.0))
                await asyncio.sleep(0.1)
                assert not step.done()
                for one in (task, step):
                    one.cancel()
                done = await asyncio.gather(task, step, return_exceptions=True)
                assert all(isinstance(one, asyncio.CancelledError) for one in done)
                await until(lambda: not any(thread.is_alive() for thread in ours))
                assert session.t == 0.0 and session.sync.snapshot().voltages == {"drive": 1.0}

    run(test())


async def until(holds: Callable[[], bool]) -> None:
    """Waits until something holds; the test has a bound."""
    while not holds():
        await asyncio.sleep(0.01)


class Gate:
    """What a call goes through on its way: it reports an arrival, and waits to be opened."""

    def __init__(self) -> None:
        self.there, self.open = threading.Event(), threading.Event()
        self.seen: list[Any] = []

    def through(self, call: Callable[..., Any], *, after: bool) -> Callable[..., Any]:
        """The call, with a wait before or after it."""

        def gated(*args: Any, **kwargs: Any) -> Any:
            result = call(*args, **kwargs) if after else None
            self.seen = [result, *args]
            self.there.set()
            assert self.open.wait(30.0)
            return result if after else call(*args, **kwargs)

        return gated

    async def cancel(self, awaited: Awaitable[Any]) -> None:
        """Cancels a call that is at the gate, which it then goes through."""
        task = asyncio.ensure_future(awaited)
        await until(self.there.is_set)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        self.open.set()


def gone(channel: Any, session: str) -> Callable[[], bool]:
    """Whether a server does not have a session any more."""

    def look() -> bool:
        try:
            channel.call("KeepAlive", device_pb2.KeepAliveRequest(session=session))
        except bimorph.NotFound:
            return True
        return False

    return look


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("kept", [False, True])
def test_a_session_that_nobody_waits_for_is_closed(
    client: bimorph.Client, server: bimorph.Server, monkeypatch: pytest.MonkeyPatch, kept: bool, after: bool
) -> None:
    """Its task was cancelled before it was joined, or when it was already open."""

    async def test() -> None:
        model = await aio.Client(server.address).compile(NET)
        gate = Gate()
        name = "bimorph.model.opened_just_now" if kept else "bimorph.model.Session"
        monkeypatch.setattr(name, gate.through(opened_just_now if kept else bimorph.Session, after=after))
        opened = Gate()
        opened.open.set()
        # what was opened is seen as its id is read
        ask = bimorph.Session._ask
        monkeypatch.setattr(bimorph.Session, "_ask", opened.through(ask, after=True))
        await gate.cancel(model.session(kept=kept))
        await until(lambda: opened.seen != [] and opened.seen[0].HasField("opened"))
        await until(gone(client._channel, opened.seen[0].opened.session))

    run(test())


def test_a_sweep_that_nobody_waits_for_is_cancelled(client: bimorph.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its task was cancelled when the server had just started it: both of `submit` and `sweep`. One with an attached client continues."""
    gaps = {"gap": [1.5e-6 + 1e-8 * k for k in range(20)]}
    kept = client.submit(NET, gaps, bimorph.PullIn(30.0, "drive"))

    async def test() -> None:
        there = aio.Client(client.address)
        for ask in (there.submit, there.sweep):
            gate = Gate()
            monkeypatch.setattr("bimorph.client.Sweep", gate.through(bimorph.Sweep, after=True))
            await gate.cancel(ask(NET, gaps, bimorph.PullIn(30.0, "drive")))
            started = gate.seen[0]

            def forgotten() -> bool:
                try:
                    started.status()
                except bimorph.NotFound:
                    return True
                return False

            await until(forgotten)
        gate = Gate()
        monkeypatch.setattr("bimorph.client.Sweep", gate.through(bimorph.Sweep, after=True))
        await gate.cancel(there.attach(kept.id))

    run(test())
    assert len(kept.wait().rows) == 20
    kept.delete()


def test_a_resume_that_nobody_waits_for_takes_nothing_away(server: bimorph.Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kept session is there, from its ticket and from the object that was to be resumed."""

    async def test() -> None:
        there = aio.Client(server.address)
        model = await there.compile(NET)
        session = await model.session(["m.x"], kept=True)
        first = await session.step({"drive": 1.0}, dt=DT)
        ticket = session.sync.ticket()
        for place in ("bimorph.client.resumed", "bimorph.session.resumed"):
            gate = Gate()
            with monkeypatch.context() as patch:
                patch.setattr(place, gate.through(resumed, after=True))
                await gate.cancel(there.resume(ticket) if "client" in place else session.resume())
                await until(lambda: gate.seen[0]._line.over is not None)
            session = await session.resume()
            assert session.accepted == first
        assert await session.step({"drive": 2.0}, dt=DT)
        await session.close()

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
