"""Sweeps as jobs: their rows come as they are finished, clients see their own, and what was cancelled keeps what it has."""

from __future__ import annotations

import asyncio
import itertools
from pathlib import Path

import pytest
from conftest import PLATE
from test_kept import start

import bimorph
from bimorph import aio

NET = bimorph.Netlist.text(PLATE.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u"), "plate.net")
PULL_IN = bimorph.PullIn(30.0, "drive")


def gaps(count: int) -> dict[str, list[float]]:
    """So many gaps between 1.5 and 2.5 um."""
    return {"gap": [1.5e-6 + 1e-6 * k / count for k in range(count)]}


def test_rows_come_while_it_runs(client: bimorph.Client) -> None:
    """The first rows are there long before the last; cancelled, it keeps those that it has, which come again from any one on."""
    sweep = client.submit(NET, gaps(100_000), PULL_IN)
    first = list(itertools.islice(sweep.rows(), 3))
    status = sweep.status()
    assert (status.state, status.over, status.netlist, status.version) == ("running", False, "plate.net", bimorph.__version__)
    with pytest.raises(bimorph.NoResult, match="no table yet"):
        sweep.table()
    sweep.cancel()
    rows = []
    with pytest.raises(bimorph.BimorphError, match="cancelled"):
        for row in sweep.rows():
            rows.append(row)
    status = sweep.status()
    assert (status.state, status.done) == ("cancelled", len(rows)) and status.ended is not None
    assert rows[:3] == first and len({row.point for row in rows}) == len(rows) < 100_000
    again = []
    with pytest.raises(bimorph.BimorphError, match="cancelled"):
        for row in sweep.rows(2):
            again.append(row)
    assert again == rows[2:]
    with pytest.raises(bimorph.BimorphError, match="cancelled"):
        sweep.table()
    sweep.delete()
    with pytest.raises(bimorph.NotFound):
        sweep.status()


def test_sweeps_are_listed_and_shared(client: bimorph.Client) -> None:
    """A client sees its sweeps, the last one first; a request to share gets the one that computes the same, which outlives a `with`."""
    before = {status.id for status in client.sweeps()}
    one = client.submit(NET, gaps(5), PULL_IN, share=True)
    with client.submit(NET, gaps(5), PULL_IN, share=True) as same:
        assert same.id == one.id
    with client.submit(NET, gaps(6), PULL_IN) as other:
        listed = [status.id for status in client.sweeps() if status.id not in before]
        assert listed == [other.id, one.id]
    assert [status.id for status in client.sweeps() if status.id not in before] == [one.id]
    assert one.wait() == client.sweep(NET, gaps(5), PULL_IN)
    one.delete()
    with pytest.raises(bimorph.InvalidRequest, match="release_after: expected"):
        client.submit(NET, gaps(5), PULL_IN, release_after=-1.0)


def test_a_killed_server_loses_no_row(program: str, tmp_path: Path) -> None:
    """The rows of a sweep go on where they were after the server was killed, each once, and its table is that of a server that was not."""
    process = start(program, tmp_path)
    try:
        client = bimorph.Client(f"unix://{tmp_path}/s", 20.0)
        whole = client.sweep(NET, gaps(300), PULL_IN)
        sweep = client.submit(NET, gaps(300), PULL_IN)
        rows, kills = [], 0
        while len(rows) < 300:
            for row in sweep.rows(len(rows)):
                rows.append(row)
                if kills < 2 and len(rows) >= 20 * (kills + 1):
                    kills += 1
                    process.kill()
                    process.wait()
                    process = start(program, tmp_path)
        assert kills == 2 and sweep.status().kept
        assert sorted(rows, key=lambda row: row.point) == whole.rows
        assert bimorph.Client(client.address).attach(sweep.id).table() == whole
    finally:
        process.kill()
        process.wait()


def test_the_same_for_asyncio(client: bimorph.Client) -> None:
    """Rows as they come, the list of sweeps, cancelling and deleting, to be awaited."""

    async def test() -> None:
        there = aio.Client(client.address)
        sweep = await there.submit(NET, gaps(100_000), PULL_IN, release_after=600.0)
        async for row in sweep:
            assert row.error == ""
            break
        assert sweep.id in {status.id for status in await there.sweeps()}
        await sweep.cancel()
        again = await there.attach(sweep.id)
        with pytest.raises(bimorph.BimorphError, match="cancelled"):
            await again.wait()
        await again.delete()
        with pytest.raises(bimorph.NotFound):
            await sweep.status()

    asyncio.run(test())
