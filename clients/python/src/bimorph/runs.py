"""Runs: many steps of one or several sessions in one call."""

from __future__ import annotations

import contextlib
import math
import os
import queue
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import labelled, plots, showing
from .acceptance import State, accept_together
from .arguments import mapping, names, one_of, text, unmasked, wrong_type
from .channel import Channel
from .errors import InvalidRequest, StepFailed, Unavailable, shown
from .local import ADDRESS
from .messages import diagnostic
from .stopping import Stopping, check, current
from .v1 import device_pb2, run_pb2

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from .session import Session

Array = NDArray[np.float64]
Given = Mapping[str, "ArrayLike"]
"""Port values by name [V, or the unit of the port's kind]: a number, or one for each time."""

_AHEAD = 4
"""Most messages that are read ahead of the caller."""
_PART = 1 << 20
"""Most port values of one request; longer runs take several requests."""


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """Steps of a session that one call took."""

    t: Array
    """Times at the ends of the steps [s]."""
    signals: dict[str, Array]
    """Each signal after each step, in its unit."""
    units: dict[str, str]
    """Unit of each signal."""
    currents: dict[str, Array]
    """Conduction current into each port after each step [A], or the response of a port of another kind."""
    charges: dict[str, Array]
    """Charge on each port after each step [C]."""
    trials: int
    """Device evaluations: the device may divide a step into shorter ones."""

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<Run of {len(self.t)} steps: {', '.join(self.signals) or 'no signals'}>"

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each signal, by time [s]; ``attrs["units"]`` has the units."""
        return showing.frame(self.signals, ("t", self.t), {"t": "s", **self.units})

    def to_xarray(self) -> xarray.Dataset:
        """The signals of :meth:`to_pandas`, each with its unit in ``attrs["units"]``."""
        return labelled.dataset(("t", self.t, "s"), self.signals, self.units, {})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws every signal over time, in its unit."""
        return plots.over_time(self.t, self.signals, self.units, ax)

    def _repr_html_(self) -> str:
        head = ["t [s]", *(f"{name} [{unit}]" for name, unit in self.units.items())]
        rows = zip(self.t.tolist(), *(values.tolist() for values in self.signals.values()))
        return showing.table(head, rows, f"{self.trials} trials")


class RunFailed(StepFailed):
    """A step of a run that the device cannot take. The state after the step before is accepted."""

    def __init__(self, message: str, index: int, t: float, run: Run) -> None:
        super().__init__(message)
        self.index = index
        """Number of the failed step, from 0."""
        self.t = t
        """Time at the end of that step [s]."""
        self.run = run
        """The run up to that step."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.index, self.t, self.run))


@dataclass(eq=False)
class Lane:
    """A session in a run, and its results."""

    session: Session
    values: Array
    """Port values at each time (n×p), or one row for all."""
    outputs: Array
    currents: Array
    charges: Array
    done: int = 0
    """Steps received."""
    trials: int = 0
    error: str = ""
    """Reason why the next step failed; empty without a failure."""
    last: Any = field(default=None)
    """Message of the reply to the last step."""

    @classmethod
    def of(cls, session: Session, values: Array, steps: int, signals: int, ports: bool) -> Lane:
        """A lane before its first step."""
        width = len(session.ports) if ports else 0
        return cls(session, values, np.empty((steps, signals)), np.empty((steps, width)), np.empty((steps, width)))

    def state(self, times: Array) -> State | None:
        """State after the last step; None before any."""
        if self.last is None:
            return None
        row = self.values[min(self.done, len(self.values)) - 1].tolist()
        reply = self.session._named(self.last, float(times[self.done - 1]), row)
        return self.session, reply, dict(reply.voltages)


class Runs:
    """Runs of a session, as a base class."""

    def run(self: Any, times: ArrayLike, voltages: Given, signals: Sequence[str] | None = None) -> Run:
        """Takes a step to each of these times [s] in turn, in one call.

        ``voltages`` has for each port a number, or an array with one for each time; ports that are not named keep their values. Between two times they
        change linearly. Every number of the result is bit-identical to that of :meth:`step` with the same voltages and ``dt``.

        ``signals`` selects some of the opened ones, by default all. A run is taken as a whole: if it is interrupted or raises an error, the session keeps
        its accepted state (beyond 2²⁰ port values: the state at the end of a part of the run).

        Raises :class:`RunFailed` for a step that the device cannot take. Its ``run`` has the steps before; the state after them is accepted.
        """
        with self._lock:
            t = checked_times(times, self.t)
            wanted = checked_signals(signals, self.signals)
            lane = Lane.of(self, port_values(self, voltages, len(t)), len(t), len(wanted), True)
            advance([lane], t, wanted, True)
            self._issue()
            return finished(lane, t, wanted)


def finished(lane: Lane, times: Array, wanted: Sequence[str]) -> Run:
    """The run of a lane that has ended.

    Raises :class:`RunFailed`.
    """
    n, session = lane.done, lane.session

    def columns(names: Iterable[str], rows: Array) -> dict[str, Array]:
        return dict(zip(names, np.ascontiguousarray(rows[:n].T)))

    currents, charges = columns(session.ports, lane.currents), columns(session.ports, lane.charges)
    units = {name: session.signals[name] for name in wanted}
    run = Run(times[:n], columns(wanted, lane.outputs), units, currents, charges, lane.trials)
    if lane.error:
        at = float(times[n])
        raise RunFailed(f"step {n}, to t = {at:.6g} s: {lane.error}", n, at, run)
    return run


def advance(
    lanes: Sequence[Lane],
    times: Array,
    signals: Sequence[str],
    ports: bool,
    progress: Callable[[float], object] | None = None,
    divide: Callable[[Sequence[Lane], Callable[[Sequence[Lane]], None]], None] | None = None,
) -> None:
    """Runs sessions of one channel along the same times; each lane has its results.

    All sessions take the states after their last steps at once, when every request has ended. Where this raises, all of them keep the states
    that they had: of a run with more than :data:`_PART` port values of a session, those after the same part of the times. ``divide`` calls its second
    argument with the lanes, by default once; it may do so in several threads.
    """
    width = max((len(lane.session.ports) for lane in lanes), default=1)
    size = max(_PART // max(width, 1), 1)
    for first in range(0, len(times), size):
        check()
        here = [lane for lane in lanes if not lane.error]
        if not here:
            return
        for lane in here:
            lane.session._usable()
        part = slice(first, min(first + size, len(times)))
        together = max(_PART // max(width * (part.stop - part.start), 1), 1)

        def request(some: Sequence[Lane], part: slice = part, together: int = together) -> None:
            for k in range(0, len(some), together):
                check()
                _advance(some[k : k + together], times, part, signals, ports, progress)

        if divide is None:
            request(here)
        else:
            divide(here, request)
        accept_together([state for lane in here if (state := lane.state(times)) is not None], warn=False)


def _advance(
    lanes: Sequence[Lane],
    times: Array,
    part: slice,
    signals: Sequence[str],
    ports: bool,
    progress: Callable[[float], object] | None,
) -> None:
    channel: Channel = lanes[0].session._channel
    here = times[part]
    request = run_pb2.RunRequest(times=_packed(here), signals=signals, ports=ports, warn=True)
    shared = lanes[0].values if all(lane.values is lanes[0].values for lane in lanes) else None
    if shared is not None:
        request.values = _packed(shared if len(shared) == 1 else shared[part])
    for lane in lanes:
        session = lane.session
        start = np.array([session._voltages[port] for port in session.ports], dtype=np.float64)
        request.lanes.add(
            session=session._session,
            parent=session.accepted.token if session.accepted else 0,
            t=session.t,
            start=_packed(start),
            values=b"" if shared is not None else _packed(lane.values if len(lane.values) == 1 else lane.values[part]),
        )
        lane.last = None
    open_lanes = set(range(len(lanes)))
    with _heard(channel, request, min(lane.session._timeout for lane in lanes)) as events:
        for event in events:
            for rows in event.rows:
                lane = _lane(lanes, rows.lane, open_lanes)
                _take(lane, rows, here, part.start, len(signals), ports)
            for end in event.ends:
                lane = _lane(lanes, end.lane, open_lanes)
                _end(lane, end, here, part.start)
                open_lanes.discard(end.lane)
            if progress is not None:
                progress((part.start + event.progress * len(here)) / len(times))
    lanes[0].session._checked.require(not open_lanes, "the stream ended before the run did")


def _lane(lanes: Sequence[Lane], number: int, open_lanes: set[int]) -> Lane:
    lanes[0].session._checked.require(number in open_lanes, f"lane {number} does not run")
    return lanes[number]


def _take(lane: Lane, rows: Any, here: Array, start: int, signals: int, ports: bool) -> None:
    """Stores the steps of a message."""
    checked, first, count = lane.session._checked, rows.first, rows.count
    begin = start + first
    in_order = begin == lane.done and first + count <= len(here)
    checked.require(in_order, f"rows: expected those from {lane.done - start} on, got {count} from {first}")
    width = len(lane.session.ports) if ports else 0
    for what, raw, into, columns in (
        ("outputs", rows.outputs, lane.outputs, signals),
        ("currents", rows.currents, lane.currents, width),
        ("charges", rows.charges, lane.charges, width),
    ):
        checked.require(len(raw) == 8 * count * columns, f"{what}: expected {count * columns} numbers, got {len(raw)} bytes")
        values = np.frombuffer(raw, dtype="<f8")
        if not np.isfinite(values).all():
            at = int(np.argmin(np.isfinite(values)))
            checked.require(False, f"{what}[{at}]: expected a finite number, got {values[at]}")
        into[begin : begin + count] = values.reshape(count, columns)
    lane.done += count


def _end(lane: Lane, end: Any, here: Array, start: int) -> None:
    """Stores the end of a lane."""
    checked, session, came = lane.session._checked, lane.session, lane.done - start
    whole = end.steps == came and (came == len(here)) == (not end.error)
    checked.require(whole, f"end: expected that of {came} of {len(here)} steps, got one of {end.steps}")
    checked.require(end.HasField("last") == (came > 0), "end: expected the reply to the last step")
    if came > 0:
        checked.require(end.last.status == device_pb2.TrialReply.STATUS_OK, "end: expected a step that was taken")
        checked.trial(end.last, len(session.ports), len(session.signals), None)
        lane.last = end.last
    session._warnings.extend(map(diagnostic, end.warnings))
    lane.trials += end.trials
    lane.error = shown(end.error)


@contextlib.contextmanager
def _heard(channel: Channel, request: Any, timeout: float) -> Iterator[Iterator[Any]]:
    """Messages of a run, with at most ``timeout`` [s] between two of them. Leaving the block stops the run."""
    outer, own = current.get(), Stopping()
    if outer is not None:
        outer.begun(own.stop)
    if channel.address != ADDRESS:
        reader = _Reader(channel, request, own)
        try:
            yield reader.events(timeout)
        finally:
            reader.leave()
        return
    before = current.set(own)
    try:
        # the stream reads its stop handle at its start
        with contextlib.closing(channel.stream("Run", request)) as events:  # type: ignore[type-var]
            yield events
    finally:
        current.reset(before)


class _Reader:
    """Reads the messages of a run in a thread, so that an interrupt of the caller cannot leave a lock of gRPC locked."""

    def __init__(self, channel: Channel, request: Any, stopping: Stopping) -> None:
        self._channel, self._request, self._stopping = channel, request, stopping
        self._events: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._room: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._left = False
        for _ in range(_AHEAD):
            self._room.put(None)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        current.set(self._stopping)
        try:
            for event in self._channel.stream("Run", self._request):
                self._room.get()
                if self._left:
                    return
                self._events.put(event)
            self._events.put(None)
        except BaseException as error:
            self._events.put(error)

    def events(self, timeout: float) -> Iterator[Any]:
        """Messages, each within ``timeout`` [s] after the one before."""
        while True:
            try:
                event = self._events.get(timeout=None if timeout == math.inf else timeout)
            except queue.Empty:
                raise Unavailable(f"server {self._channel.address}: no answer within {timeout} s") from None
            if event is None:
                return
            if isinstance(event, BaseException):
                raise event
            self._room.put(None)
            yield event

    def leave(self) -> None:
        """Stops the run."""
        self._left = True
        self._stopping.stop()
        self._room.put(None)


def _packed(values: Array) -> bytes:
    return np.ascontiguousarray(values, dtype="<f8").tobytes()


def checked_times(times: ArrayLike, after: float) -> Array:
    """Checked times of a run that begins at ``after`` [s].

    Raises :class:`InvalidRequest`.
    """
    found = numbers("times", times)
    if found.ndim != 1 or found.size == 0:
        raise InvalidRequest(f"times: expected a list of times [s], got {'a number' if found.ndim == 0 else f'an array of shape {found.shape}'}")
    if found[0] <= after:
        raise InvalidRequest(f"times[0]: expected a time after that of the session, {after:g} s, got {found[0]:g} s")
    late = np.flatnonzero(np.diff(found) <= 0)
    if late.size:
        at = int(late[0])
        raise InvalidRequest(f"times[{at + 1}]: expected ascending times, got {found[at + 1]:g} s after {found[at]:g} s")
    return found


def checked_signals(wanted: Sequence[str] | None, opened: Mapping[str, str]) -> list[str]:
    """Checked names of opened signals; by default all.

    Raises :class:`InvalidRequest`.
    """
    if wanted is None:
        return list(opened)
    return [one_of(f"signals[{k}]", name, opened, "signals of the session") for k, name in enumerate(names("signals", wanted))]


def numbers(what: str, given: ArrayLike) -> Array:
    """Finite numbers.

    Raises :class:`InvalidRequest`.
    """
    unmasked(what, given)
    try:
        raw = np.asarray(given)
        found = np.asarray(raw, dtype=np.float64) if raw.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        found = None
    if found is None:
        raise wrong_type(what, "numbers (in rows of equal length)", given)
    if not np.isfinite(found).all():
        raise InvalidRequest(f"{what}: expected finite numbers, got {found[~np.isfinite(found)][0]}")
    return found


def arrays(voltages: Given) -> dict[str, Array]:
    """Port values by name, as arrays of finite numbers.

    Raises :class:`InvalidRequest`.
    """
    given = mapping("voltages", voltages, 'names of ports with their volts, as {"drive": 3.0}')
    return {text("voltages: name of a port", port, "a text"): numbers(f"voltages[{port!r}]", value) for port, value in given.items()}


def port_values(session: Any, voltages: Given, steps: int, lane: int | None = None, lanes: int = 1) -> Array:
    """Port values of a session at each time (n×p), or one row if all are constant. For a lane of a batch, arrays may have a row for each lane."""
    voltages = arrays(voltages)
    unknown = [name for name in voltages if name not in session.ports]
    if unknown:
        raise InvalidRequest(f"voltages: no port named {unknown[0]!r}; the session has {', '.join(session.ports) or 'none'}")
    columns: list[Array] = []
    for port in session.ports:
        given = voltages[port] if port in voltages else np.array(session._voltages[port])
        if lane is not None and given.ndim == 2 and given.shape[0] == lanes:
            given = given[lane]
        if given.ndim == 0 or given.shape == (1,):
            columns.append(given.reshape(1))
        elif given.shape == (steps,):
            columns.append(given)
        else:
            of_lanes = "" if lane is None else f", or a row for each of {lanes} sessions (an array of shape ({lanes}, 1) or ({lanes}, {steps}))"
            raise InvalidRequest(
                f"voltages[{port!r}]: expected a number, or one for each of {steps} times{of_lanes}, got an array of shape {given.shape}"
            )
    rows = max((len(column) for column in columns), default=1)
    return np.column_stack([np.broadcast_to(column, rows) for column in columns]) if columns else np.empty((1, 0))


def workers(channel: Channel, lanes: int) -> int:
    """Number of concurrent requests: in process the number of cores, on a server at most 4."""
    cores = os.process_cpu_count() if hasattr(os, "process_cpu_count") else os.cpu_count()
    most = (cores or 1) if channel.address == ADDRESS else min(cores or 1, 4)
    return max(min(most, lanes), 1)
