"""A sweep that runs on a server while clients come and go."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import TracebackType

from .channel import Channel
from .errors import BimorphError, Unavailable
from .stopping import apart
from .sweep import Row, Table
from .v1 import sweep_pb2

_STATES = {
    sweep_pb2.SweepStatus.STATE_RUNNING: "running",
    sweep_pb2.SweepStatus.STATE_DONE: "done",
    sweep_pb2.SweepStatus.STATE_FAILED: "failed",
    sweep_pb2.SweepStatus.STATE_CANCELLED: "cancelled",
}


@dataclass(frozen=True)
class SweepStatus:
    """How far a sweep has come."""

    state: str
    """"running", "done", "failed" or "cancelled"."""
    done: int
    """Points finished, failed ones among them."""
    points: int
    """Points of the sweep."""
    failed: int
    """Points without a result."""
    message: str
    """Why it has no table."""


class Sweep:
    """A sweep on a server: :meth:`Client.submit` starts one, :meth:`Client.attach` finds one again by its ``id``, also from another process.

    It runs whether or not anybody waits for it. The end of a ``with`` block cancels it and lets the server forget it.
    """

    def __init__(self, channel: Channel, id: str, vary: tuple[str, ...] = ()) -> None:
        self._channel = channel
        self._vary = vary
        self.id = id
        """Its name on the server."""

    def __repr__(self) -> str:
        return f"<Sweep {self.id} on {self._channel.address}>"

    def status(self) -> SweepStatus:
        """Where it stands now."""
        for status in self.watch():
            return status
        raise BimorphError(f"server {self._channel.address}: no word of sweep {self.id}")

    def wait(self, progress: Callable[[int, int], object] | None = None) -> Table:
        """Its table, once it is done; ``progress`` is told (points done, points). A network that fails meanwhile costs it nothing: it is
        asked for again.

        Raises :class:`BimorphError` when it ends without one.
        """
        self._follow(progress)
        return self.table()

    def rows(self) -> Iterator[Row]:
        """The rows of its table one by one, once it is done, as they come: no more of them are held than a message has. A network that
        fails meanwhile costs it nothing.

        Raises :class:`BimorphError` when it ends without a table.
        """
        self._follow(None)
        given = 0
        while True:
            try:
                rows = (item for item in self._fetch() if isinstance(item, Row))
                for row in itertools.islice(rows, given, None):
                    yield row
                    given += 1
                return
            except Unavailable as error:
                failure = error
            # the rest: where nothing answers, this raises
            if self._channel.persist(lambda heard: self.status()).points <= given:
                raise failure

    def table(self) -> Table:
        """What it found; only of a sweep that is done."""

        def whole(heard: Callable[[], None]) -> Table:
            rows, head = [], _Head()
            for item in self._fetch():
                if isinstance(item, Row):
                    rows.append(item)
                else:
                    head = item
            return Table(head.parameters, head.results, head.units, rows)

        table = self._channel.persist(whole)
        if any(name not in table.parameters for name in self._vary):
            raise BimorphError("the server is of an earlier version, which knows no samples")
        return table

    def _follow(self, progress: Callable[[int, int], object] | None) -> None:
        def follow(heard: Callable[[], None]) -> None:
            status = None
            for status in self.watch():
                heard()
                if progress is not None:
                    progress(status.done, status.points)
                if status.state in ("failed", "cancelled"):
                    raise BimorphError(f"the sweep ended after {status.done} points: {status.message}")
            if status is None or status.state != "done":
                raise Unavailable(f"server {self._channel.address}: the stream ended before the sweep did")

        self._channel.persist(follow)

    def cancel(self) -> None:
        """Ends it, if it still runs, and lets the server forget it."""
        self._channel.call("CancelSweep", sweep_pb2.CancelSweepRequest(sweep=self.id))

    def __enter__(self) -> Sweep:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(BimorphError), apart():
            self.cancel()

    def watch(self) -> Iterator[SweepStatus]:
        """How far it has come, until it ends."""
        for status in self._channel.stream("WatchSweep", sweep_pb2.WatchSweepRequest(sweep=self.id)):
            state = _STATES.get(status.state, "running")
            yield SweepStatus(state, status.done, status.points, status.failed, status.message)

    def _fetch(self) -> Iterator[_Head | Row]:
        """What the columns of the table are, and every row."""
        points, rows, head = self.status().points, 0, _Head()
        for chunk in self._channel.stream("FetchSweep", sweep_pb2.FetchSweepRequest(sweep=self.id)):
            if chunk.parameters or chunk.results:
                head = _Head(list(chunk.parameters), list(chunk.results), dict(zip(chunk.results, chunk.units)))
                yield head
            for row in chunk.rows:
                values = [v.number if v.WhichOneof("value") == "number" else v.text for v in row.parameters]
                present = {name: x for name, x in zip(head.results, row.results) if x == x}
                estimate = row.estimated_error if row.HasField("estimated_error") else None
                rows += 1
                yield Row(row.point, dict(zip(head.parameters, values)), present, row.error, estimate, row.warning)
        if rows != points:
            raise Unavailable(f"server {self._channel.address}: the table ended after {rows} of {points} points")


@dataclass(frozen=True)
class _Head:
    """Columns of a table."""

    parameters: list[str] = field(default_factory=list)
    results: list[str] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
