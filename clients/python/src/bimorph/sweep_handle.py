"""A sweep that runs on a server while clients come and go."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from .channel import Channel
from .errors import BimorphError, Unavailable
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
        for status in self._watch():
            return status
        raise BimorphError(f"server {self._channel.address}: no word of sweep {self.id}")

    def wait(self, progress: Callable[[int, int], object] | None = None) -> Table:
        """Its table, once it is done; ``progress`` is told (points done, points). A network that fails meanwhile costs it nothing: it is
        asked for again.

        Raises :class:`BimorphError` when it ends without one.
        """

        def follow(heard: Callable[[], None]) -> None:
            status = None
            for status in self._watch():
                heard()
                if progress is not None:
                    progress(status.done, status.points)
                if status.state in ("failed", "cancelled"):
                    raise BimorphError(f"the sweep ended after {status.done} points: {status.message}")
            if status is None or status.state != "done":
                raise Unavailable(f"server {self._channel.address}: the stream ended before the sweep did")

        self._channel.persist(follow)
        return self.table()

    def table(self) -> Table:
        """What it found; only of a sweep that is done."""
        table = self._channel.persist(lambda heard: self._fetch())
        if any(name not in table.parameters for name in self._vary):
            raise BimorphError("the server is of an earlier version, which knows no samples")
        return table

    def cancel(self) -> None:
        """Ends it, if it still runs, and lets the server forget it."""
        self._channel.call("CancelSweep", sweep_pb2.CancelSweepRequest(sweep=self.id))

    def __enter__(self) -> Sweep:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.cancel()
        except BimorphError:
            pass

    def _watch(self) -> Iterator[SweepStatus]:
        for status in self._channel.stream("WatchSweep", sweep_pb2.WatchSweepRequest(sweep=self.id)):
            state = _STATES.get(status.state, "running")
            yield SweepStatus(state, status.done, status.points, status.failed, status.message)

    def _fetch(self) -> Table:
        points = self.status().points
        parameters: list[str] = []
        results: list[str] = []
        units: dict[str, str] = {}
        rows: list[Row] = []
        for chunk in self._channel.stream("FetchSweep", sweep_pb2.FetchSweepRequest(sweep=self.id)):
            if chunk.parameters or chunk.results:
                parameters, results = list(chunk.parameters), list(chunk.results)
                units = dict(zip(results, chunk.units))
            for row in chunk.rows:
                values = [v.number if v.WhichOneof("value") == "number" else v.text for v in row.parameters]
                present = {name: x for name, x in zip(results, row.results) if x == x}
                estimate = row.estimated_error if row.HasField("estimated_error") else None
                rows.append(Row(row.point, dict(zip(parameters, values)), present, row.error, estimate, row.warning))
        if len(rows) != points:
            raise Unavailable(f"server {self._channel.address}: the table ended after {len(rows)} of {points} points")
        return Table(parameters, results, units, rows)
