"""Sweeps on many processes or machines: the shards of one table over any executor."""

from __future__ import annotations

import atexit
import contextlib
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from .client import Client
from .conversion import LAYOUTS
from .errors import BimorphError, Unavailable
from .netlist import Netlist
from .server import Server, serve
from .sweep import Analysis, Axes, Samples, Table

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options


class Future(Protocol):
    """A task's result to come."""

    def result(self) -> Any:
        """It, or its exception."""


class Executor(Protocol):
    """What runs tasks: ``concurrent.futures``, ``distributed.Client`` (Dask), mpi4py's, ipyparallel's, …"""

    def submit(self, task: Callable[..., Any], /, *arguments: Any) -> Any:
        """Starts a task."""


def sweep_on(
    executor: Executor,
    netlist: str | os.PathLike[str] | Netlist,
    parameters: Axes,
    analysis: Analysis,
    *,
    shards: int,
    server: str | None = None,
    set: Mapping[str, float | str] | None = None,
    include: Iterable[str | os.PathLike[str]] = (),
    samples: Samples | None = None,
    retries: int = 2,
    progress: Callable[[int, int], object] | None = None,
    **options: Unpack[Options],
) -> Table:
    """The table of :meth:`Client.sweep`, computed in ``shards`` parts as tasks of ``executor``: the same rows, whoever computes them.

    Each worker process starts a server of its own, which ends with it (the program ``bimorph`` must be there), or all talk to
    ``server``. A part whose server or connection dies is given out again, ``retries`` times; what becomes of a worker that dies is
    the executor's own: Dask starts it anew, a process pool is broken. ``progress`` is told (parts done, parts).

    Raises :class:`BimorphError`, or what the executor raises.
    """
    if shards < 1:
        raise ValueError(f"shards: expected at least 1, got {shards}")
    if not isinstance(netlist, Netlist):
        if os.path.splitext(netlist)[1].lower() in LAYOUTS:
            raise ValueError(f"{os.fspath(netlist)} is a layout: make a netlist of it first, client.convert(…).netlist")
        netlist = Netlist.read(netlist, include)
    bundle = netlist

    def start(number: int) -> Any:
        shard = (number, shards)
        return executor.submit(part, server, bundle, dict(parameters), analysis, dict(set or {}), samples, shard, dict(options))

    running = [start(number) for number in range(shards)]
    tables: list[Table] = []
    for number in range(shards):
        for left in reversed(range(retries + 1)):
            try:
                tables.append(running[number].result())
                break
            except Unavailable:
                if left == 0:
                    raise
                running[number] = start(number)
        if progress is not None:
            progress(number + 1, shards)
    return together(tables)


def together(tables: Sequence[Table]) -> Table:
    """The shards of one sweep as the table of the whole.

    A netlist whose nodes depend on a parameter has results in one shard that another has not: columns stand in the order in which rows
    have them first, as in a sweep in one run.

    Raises :class:`BimorphError` for shards of different sweeps, or a point that is there twice.
    """
    units: dict[str, str] = {}
    for table in tables:
        first = tables[0]
        if table.parameters != first.parameters or any(units.get(name, unit) != unit for name, unit in table.units.items()):
            raise BimorphError(f"not the shards of one sweep: {table!r} beside {first!r}")
        units |= table.units
    pairs = sorted(((row, table) for table in tables for row in table.rows), key=lambda pair: pair[0].point)
    rows = [row for row, _ in pairs]
    twice = [row.point for row, after in zip(rows, rows[1:]) if row.point == after.point]
    if twice:
        raise BimorphError(f"point {twice[0]} is in two shards")
    # what stands before the last result of a row in its table is of this row too, or of one that came before
    ordered: dict[str, None] = {}
    for row, table in pairs:
        last = max((k for k, name in enumerate(table.results) if name in row.results), default=-1)
        ordered |= dict.fromkeys(table.results[: last + 1])
    for table in tables:
        ordered |= dict.fromkeys(table.results)
    return Table(tables[0].parameters, list(ordered), {name: units[name] for name in ordered}, rows)


def part(
    server: str | None,
    netlist: Netlist,
    parameters: dict[str, Sequence[float | str]],
    analysis: Analysis,
    set: dict[str, float | str],
    samples: Samples | None,
    shard: tuple[int, int],
    options: dict[str, Any],
) -> Table:
    """One shard, where this is called: what :func:`sweep_on` submits."""
    with Client(server) if server else _own().client() as client:
        return client.sweep(netlist, parameters, analysis, set=set, samples=samples, shard=shard, **options)


_lock = threading.Lock()
_stack = contextlib.ExitStack()
"""Ends the server of this process."""
_server: Server | None = None
_inherited: list[contextlib.ExitStack] = []


def _own() -> Server:
    """The server of this process, started when it is first asked for, and again when it died. It ends with the process, while its
    threads still run."""
    global _server
    with _lock:
        if _server is None or _server.process.poll() is not None:
            _stack.close()
            _server = _stack.enter_context(serve())
        return _server


@atexit.register
def _end() -> None:
    with _lock:
        _stack.close()


def _forked() -> None:
    """In a child: the server of the parent is neither used nor ended."""
    global _lock, _stack, _server
    _inherited.append(_stack)
    _lock, _stack, _server = threading.Lock(), contextlib.ExitStack(), None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)
