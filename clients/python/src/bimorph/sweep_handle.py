"""A sweep on a server, which runs independently of its clients: a job of the protocol."""

from __future__ import annotations

import contextlib
import datetime
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NamedTuple

from .arguments import function, integer
from .channel import Channel
from .errors import BimorphError, NoResult, NotFound, Unavailable
from .stopping import apart
from .table import Row, Table, with_results
from .v1 import jobs_pb2

_STATES = {
    jobs_pb2.JobMetadata.STATE_WAITING: "waiting",
    jobs_pb2.JobMetadata.STATE_RUNNING: "running",
    jobs_pb2.JobMetadata.STATE_DONE: "done",
    jobs_pb2.JobMetadata.STATE_CANCELLED: "cancelled",
    jobs_pb2.JobMetadata.STATE_FAILED: "failed",
}

_ATTEMPTS = 6
"""Most streams in a row that break without a message, before fetching rows fails."""

_LEAVE_S = 5.0
"""Longest wait for a server at the end of a ``with`` block [s]."""


@dataclass(frozen=True)
class SweepStatus:
    """Status of a sweep."""

    state: str
    """"waiting" for its first computation, "running", "done", "cancelled" or "failed"."""
    done: int
    """Finished points, including failed ones: the number of rows."""
    points: int
    """Points of the sweep."""
    failed: int
    """Points without a result."""
    message: str
    """Reason why it ended without all of its rows."""
    id: str = ""
    """Name on the server."""
    netlist: str = ""
    """Root file of the netlist."""
    version: str = ""
    """Version of the program that computes its rows."""
    submitted: datetime.datetime | None = None
    """Time of submission."""
    ended: datetime.datetime | None = None
    """Time of its end; None while it runs."""
    kept: bool = False
    """Whether the server stores it, so that it survives a restart."""

    @property
    def over(self) -> bool:
        """Whether it has ended: done, cancelled or failed."""
        return self.ended is not None


def status_of(job: Any) -> SweepStatus:
    """A status from its message."""
    about = job.metadata
    return SweepStatus(
        _STATES.get(about.state, "running"),
        about.rows,
        about.points,
        about.failed,
        job.error.message,
        job.name,
        about.provenance.netlist,
        about.provenance.version,
        _time(about, "submitted"),
        _time(about, "ended"),
        about.kept,
    )


def _time(about: Any, name: str) -> datetime.datetime | None:
    if not about.HasField(name):
        return None
    time: datetime.datetime = getattr(about, name).ToDatetime(datetime.UTC)
    return time


class Sweep:
    """A sweep on a server: :meth:`Client.submit` starts one, :meth:`Client.attach` finds one again by its ``id``, also from another process.

    It runs independently of its clients. The end of a ``with`` block cancels and deletes it, unless it is shared
    or was attached to.
    """

    def __init__(self, channel: Channel, id: str, shared: bool = False, is_part: bool = False) -> None:
        self._channel = channel
        self._shared = shared
        self._is_part = is_part
        self.id = id
        """Name on the server."""

    def __repr__(self) -> str:
        return f"<Sweep {self.id} on {self._channel.address}>"

    def status(self) -> SweepStatus:
        """Its present status."""
        return status_of(self._channel.call("GetJob", jobs_pb2.GetJobRequest(name=self.id)))

    def wait(self, progress: Callable[[int, int], object] | None = None) -> Table:
        """Waits for its end and returns its table. ``progress`` is called with (points done, points). After a failure of the network the rows
        continue where they were.

        Raises :class:`BimorphError` if it ends without all of its rows, and :class:`NoResult` if no row has a result.
        """
        found = self._whole(function("progress", progress))
        # a part may lack columns of other parts
        return found if self._is_part else with_results(found)

    def _whole(self, progress: Callable[[int, int], object] | None = None) -> Table:
        """Its table, also if no row has a result."""
        points = self._persistent_status().points
        rows: list[_Found] = []
        parameters: list[str] = []
        for chunk in self._chunks(0):
            rows.extend(chunk.found)
            parameters = chunk.parameters
            if progress is not None:
                progress(len(rows), points)
        return _table(parameters, rows)

    def rows(self, first: int = 0) -> Iterator[Row]:
        """Yields its rows in the order in which they finish, from number ``first`` on; rows keep their numbers. At most the rows of one message
        are in memory. After a failure of the network the rows continue where they were.

        Raises :class:`BimorphError` after the last row if it ends without all of them, and if a server has lost rows and computed them
        again with other numbers.
        """
        return self._rows(integer("first", first))

    def _rows(self, first: int) -> Iterator[Row]:
        for chunk in self._chunks(first):
            for found in chunk.found:
                yield found.row

    def table(self) -> Table:
        """Table of a sweep that is done.

        Raises :class:`NoResult` if it is running, and :class:`BimorphError` if it was cancelled or has failed; :meth:`rows` has its finished rows.
        """
        status = self._persistent_status()
        if not status.over:
            raise NoResult(f"the sweep has no table yet: {status.done} of {status.points} points done")
        return self.wait()

    def cancel(self) -> None:
        """Cancels it if it is running. Its finished rows stay. The call is repeated while the network fails."""
        request = jobs_pb2.CancelJobRequest(name=self.id)
        self._channel.persist(lambda: self._channel.call("CancelJob", request))

    def delete(self) -> None:
        """Cancels it if it is running, and deletes it on the server. The call is repeated while the network fails."""
        self._delete(None)

    def _delete(self, within: float | None) -> None:
        request = jobs_pb2.DeleteJobRequest(name=self.id)
        tries = 0

        def ask() -> None:
            nonlocal tries
            tries += 1
            try:
                self._channel.call("DeleteJob", request)
            except NotFound:
                # an earlier attempt succeeded, and only its reply was lost
                if tries == 1:
                    raise

        self._channel.persist(ask, within)

    def __enter__(self) -> Sweep:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._shared:
            with contextlib.suppress(BimorphError), apart():
                self._delete(_LEAVE_S)

    def watch(self) -> Iterator[SweepStatus]:
        """Yields its status after each change, until it ends."""
        for job in self._channel.stream("WatchJob", jobs_pb2.WatchJobRequest(name=self.id)):
            yield status_of(job)

    def _persistent_status(self) -> SweepStatus:
        return self._channel.persist(lambda: self.status())

    def _chunks(self, first: int) -> Iterator[_Chunk]:
        """Messages of rows from a number on; after a failure of the network from the next number on."""
        breaks = 0
        known: set[int] = set()
        while True:
            try:
                for chunk in self._fetch(first):
                    for found in chunk.found:
                        point = found.row.point
                        if point in known:
                            raise BimorphError(f"point {point} was received twice, because the server has lost rows and computed them again; fetch the rows again")
                        known.add(point)
                    first += len(chunk.found)
                    breaks = 0
                    yield chunk
                return
            except Unavailable as error:
                failure = error
            breaks += 1
            if breaks >= _ATTEMPTS:
                raise failure
            # raises if the server does not reply
            self._persistent_status()

    def _fetch(self, first: int) -> Iterator[_Chunk]:
        """Messages of rows from a number on, of one stream."""
        parameters: list[str] = []
        columns: list[tuple[tuple[str, str], ...]] = []
        for chunk in self._channel.stream("FetchJob", jobs_pb2.FetchJobRequest(name=self.id, first_row=first)):
            parameters = list(chunk.parameters) or parameters
            columns += (tuple(zip(column.results, column.units)) for column in chunk.columns)
            found = [_found(row.row, parameters, columns[row.columns] if row.row.results else ()) for row in chunk.rows]
            yield _Chunk(parameters, found)
            if chunk.HasField("job"):
                status = status_of(chunk.job)
                if status.state != "done":
                    raise BimorphError(f"the sweep ended after {status.done} of {status.points} points: {status.message}")
                return
        raise Unavailable(f"server {self._channel.address}: the stream ended before the sweep did")


class _Found(NamedTuple):
    """A row, with the names and units of all of its columns."""

    row: Row
    columns: tuple[tuple[str, str], ...]


class _Chunk(NamedTuple):
    """Rows of one message."""

    parameters: list[str]
    found: list[_Found]


def _found(row: Any, parameters: list[str], columns: tuple[tuple[str, str], ...]) -> _Found:
    values = [v.number if v.WhichOneof("value") == "number" else v.text for v in row.parameters]
    present = {name: x for (name, _), x in zip(columns, row.results, strict=True) if x == x}
    estimate = row.estimated_error if row.HasField("estimated_error") else None
    found = Row(row.point, dict(zip(parameters, values)), present, row.error, estimate, row.warning)
    return _Found(found, columns)


def _table(parameters: list[str], found: list[_Found]) -> Table:
    """Table in grid order, with columns in the order of their first row."""
    found.sort(key=lambda one: one.row.point)
    units: dict[str, str] = {}
    for columns in dict.fromkeys(one.columns for one in found):
        for name, unit in columns:
            units.setdefault(name, unit)
    return Table(parameters, list(units), units, [one.row for one in found])
