"""Sweeps on many processes or machines: the shards of one table over any executor."""

from __future__ import annotations

import inspect
import os
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from .arguments import function, integer, path, settings, text, wrong_type
from .client import Client
from .conversion import LAYOUTS
from .errors import BimorphError, InvalidRequest, Unavailable
from .messages import options_to_wire
from .netlist import Netlist
from .server import Server
from .sweep import Analysis, Axes, Samples
from .sweep_wire import to_wire
from .table import Table, with_results

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options


class Future(Protocol):
    """Future of a task."""

    def result(self) -> Any:
        """Result of the task, or its exception."""


class Executor(Protocol):
    """Interface for tasks, as in ``concurrent.futures``, ``distributed.Client`` (Dask), mpi4py's, ipyparallel's, …"""

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
    """The table of :meth:`Client.sweep`, computed in ``shards`` parts as tasks of ``executor``. The rows do not depend on the executor.

    Each worker process starts its own server, which ends with it (the program ``bimorph`` must be installed there), or all use
    ``server``. A part whose server or connection fails is submitted again as a new task, ``retries`` times. The executor handles the loss of a
    worker: Dask restarts it, a process pool breaks. ``progress`` is called with (parts done, parts).

    Raises :class:`BimorphError`, :class:`NoResult` if no point has a result, or the exception of the executor.
    """
    if not callable(getattr(executor, "submit", None)):
        raise wrong_type("executor", "an object with a method submit(task, *arguments)", executor)
    shards, retries = integer("shards", shards, 1), integer("retries", retries, 0)
    server = None if server is None else text("server", server, "the address of a server")
    function("progress", progress)
    if not isinstance(netlist, Netlist):
        if os.path.splitext(path("netlist", netlist, "a path or a Netlist"))[1].lower() in LAYOUTS:
            raise InvalidRequest(f"netlist: {os.fspath(netlist)} is a layout: make a netlist of it first, client.convert(…).netlist")
        netlist = Netlist._read("netlist", netlist, include)
    bundle, set = netlist, settings("set", set)
    # reject invalid arguments before any part is submitted
    to_wire(parameters, analysis, (0, shards), samples)
    options_to_wire(set, options)

    # Dask names a task by its arguments and reuses the result of an equal name, also if that is an error.
    own_name = {"pure": False} if _names_tasks(executor) else {}

    def start(number: int) -> Any:
        shard = (number, shards)
        given = (server, bundle, dict(parameters), analysis, dict(set or {}), samples, shard, dict(options))
        return executor.submit(part, *given, **own_name)

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
    return with_results(together(tables))


def together(tables: Sequence[Table]) -> Table:
    """The shards of one sweep as the table of the whole.

    If the nodes of a netlist depend on a parameter, shards have different columns. Columns are in the order of their first row, as in a sweep
    in one run.

    Raises :class:`BimorphError` for shards of different sweeps, or for a repeated point.
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
    # columns before the last result of a row in its table belong to this row or to an earlier one
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
    """Task of :func:`sweep_on`: one shard, computed in the calling process."""
    with Client(server) if server else _own().client() as client:
        # a part may lack columns of other parts
        with client.submit(netlist, parameters, analysis, set=set, samples=samples, shard=shard, **options) as running:
            return running._whole()


def _names_tasks(executor: Executor) -> bool:
    try:
        return "pure" in inspect.signature(executor.submit).parameters
    except (TypeError, ValueError):
        return False


_lock = threading.Lock()
_server: Server | None = None
_inherited: list[Server | None] = []


def _own() -> Server:
    """The server of this process, started at first use and again after a crash. It stops at the end of the process, while
    its threads still run."""
    global _server
    with _lock:
        if _server is None:
            _server = Server()
        return _server.start()


def _forked() -> None:
    """In a forked child: the server of the parent is neither used nor stopped."""
    global _lock, _server
    _inherited.append(_server)
    _lock, _server = threading.Lock(), None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)
