"""Sessions that are stepped together, as arrays: copies of one model, or variants."""

from __future__ import annotations

import contextlib
import contextvars
import queue
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from . import labelled, plots, showing
from .acceptance import State, accept_together
from .arguments import MAX_STEP, instance, items, number
from .errors import InvalidRequest
from .model import Model
from .runs import Array, Given, Lane, advance, arrays, checked_signals, checked_times, port_values, workers
from .session import Session
from .stopping import Stopping, current

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

_LOOK = 0.1
"""Longest wait between two checks for signals [s]."""


@dataclass(frozen=True)
class Failure:
    """Step at which a session of a batch stopped."""

    index: int
    """Number of the failed step, from 0."""
    t: float
    """Time at the end of that step [s]."""
    reason: str
    """Reason of the failure."""


@dataclass(frozen=True, eq=False, repr=False)
class BatchRun:
    """Steps of a batch: arrays with a row for each session and a column for each time."""

    t: Array
    """Times at the ends of the steps [s] (n)."""
    signals: dict[str, Array]
    """Each signal, in its unit (sessions×n); NaN after the last step of a session."""
    units: dict[str, str]
    """Unit of each signal."""
    currents: dict[str, Array]
    """Conduction current into each port [A], or the response of a port of another kind (sessions×n)."""
    charges: dict[str, Array]
    """Charge on each port [C] (sessions×n)."""
    failures: dict[int, Failure]
    """Failed step by session, for sessions that stopped before the last time."""

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each signal, by session, from 0, and time [s]; ``attrs["units"]`` has the units."""
        columns = {name: values.ravel() for name, values in self.signals.items()}
        return showing.frame_of_sessions(columns, self._count(), self.t, {"t": "s", **self.units})

    def to_xarray(self) -> xarray.Dataset:
        """The signals over ``session``, from 0, and ``t`` [s], each with its unit in ``attrs["units"]``."""
        return labelled.of_sessions(self.t, self.signals, self.units)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws every signal over time: a colour for each signal, and a line for each session."""
        return plots.batch(self, ax)

    def _repr_html_(self) -> str:
        head = ["session", "steps", *(f"{name} [{unit}]" for name, unit in self.units.items()), ""]
        failures = [self.failures.get(k) for k in range(self._count())]
        rows = (
            [k, steps, *(float(values[k, steps - 1]) if steps else None for values in self.signals.values()), failure.reason if failure else ""]
            for k, failure in enumerate(failures)
            for steps in [failure.index if failure else len(self.t)]
        )
        return showing.table(head, rows, "signals after the last step of each session")

    def _count(self) -> int:
        return len(next(iter((self.currents or self.signals).values()), ()))

    def __repr__(self) -> str:
        lost = f", {len(self.failures)} stopped early" if self.failures else ""
        return f"<BatchRun of {self._count()} sessions, {len(self.t)} steps: {', '.join(self.signals) or 'no signals'}{lost}>"


class Batch:
    """Sessions with the same ports and signals, stepped together; use it in a ``with`` block, which closes them.

    One call steps all of them: in this process on all cores, on a server in few requests. The results of each session are bit-identical to
    those of the session alone.
    """

    def __init__(self, sessions: Sequence[Session]) -> None:
        self.sessions: tuple[Session, ...] = tuple(items("sessions", sessions, "a list of sessions"))
        """Sessions, in the order of the rows of results."""
        if not self.sessions:
            raise InvalidRequest("sessions: expected at least one session, got none")
        for k, session in enumerate(self.sessions):
            instance(f"sessions[{k}]", session, Session, "a Session")
        first = self.sessions[0]
        for k, session in enumerate(self.sessions):
            if session.ports != first.ports or session.signals != first.signals:
                raise InvalidRequest(f"sessions[{k}]: expected ports {list(first.ports)} and signals {list(first.signals)}, as sessions[0] has, got {list(session.ports)} and {list(session.signals)}")
            if session._channel.address != first._channel.address:
                raise InvalidRequest(f"sessions[{k}]: expected a session on {first._channel.address}, as sessions[0] is, got one on {session._channel.address}")
            if session in self.sessions[:k]:
                raise InvalidRequest(f"sessions[{k}]: expected each session once, got that of sessions[{self.sessions.index(session)}] again")
        self._pool: ThreadPoolExecutor | None = None

    @classmethod
    def of(cls, models: Sequence[Model], signals: Sequence[str] = (), ports: Sequence[str] = (), timeout: float = 60.0) -> Batch:
        """Opens one session for each model: variants, or one model several times. Arguments as of :meth:`Model.session`."""
        sessions: list[Session] = []
        try:
            given = items("models", models, "a list of models")
            if not given:
                raise InvalidRequest("models: expected at least one model, got none")
            for k, model in enumerate(given):
                instance(f"models[{k}]", model, Model, "a Model")
                sessions.append(model.session(signals, ports, timeout))
            return cls(sessions)
        except BaseException:
            for session in sessions:
                session.close()
            raise

    def __len__(self) -> int:
        return len(self.sessions)

    @property
    def ports(self) -> tuple[str, ...]:
        """Ports of each session."""
        return self.sessions[0].ports

    @property
    def signals(self) -> dict[str, str]:
        """Opened signals of each session, and their units."""
        return self.sessions[0].signals

    @property
    def t(self) -> Array:
        """Time of each session [s]."""
        return np.array([session.t for session in self.sessions])

    def operating_point(self, voltages: Given) -> None:
        """Accepts the static equilibrium of each session at these port voltages [V], and sets the time to 0 s. ``voltages`` has for each port
        a number, or an array with one for each session.

        It is taken as a whole: where one equilibrium is not found, or the call is interrupted, every session keeps its state.

        Raises :class:`StepFailed` where one is not found.
        """
        count = len(self.sessions)
        held = arrays(voltages)
        for port, value in held.items():
            if value.shape not in ((), (count,)):
                raise InvalidRequest(f"voltages[{port!r}]: expected a number, or one for each of {count} sessions, got an array of shape {value.shape}")
        with self._locked():
            states: list[State] = []
            for k, session in enumerate(self.sessions):
                given = {port: float(value if value.ndim == 0 else value[k]) for port, value in held.items()}
                reply = replace(session.trial(given), t=0.0)
                states.append((session, reply, dict(reply.voltages)))
            accept_together(states)

    def run(self, times: ArrayLike, voltages: Given, signals: Sequence[str] | None = None) -> BatchRun:
        """Steps every session to each of these times [s] in turn.

        ``voltages`` has for each port a number, an array with one for each time, or an array with a row for each session. A row has one number,
        or one for each time. A session that cannot take a step stops there, and the others continue.

        The batch is taken as a whole: if the call is interrupted or a session cannot be reached, every session keeps its state (beyond 2²⁰ port
        values for a session: all have the state at the end of the same part of the times).
        """
        with self._locked():
            count = len(self.sessions)
            t = checked_times(times, float(self.t.max()))
            wanted = checked_signals(signals, self.signals)
            voltages = arrays(voltages)
            varied = any(value.ndim == 2 for value in voltages.values())
            alike = not varied and all(session._voltages == self.sessions[0]._voltages for session in self.sessions)
            shared = port_values(self.sessions[0], voltages, len(t)) if alike else None
            lanes = [
                Lane.of(
                    session,
                    shared if shared is not None else port_values(session, voltages, len(t), k, count),
                    len(t),
                    len(wanted),
                    True,
                )
                for k, session in enumerate(self.sessions)
            ]
            advance(lanes, t, wanted, True, divide=self._divide)
            for k, session in enumerate(self.sessions):
                session._issue(about=f"sessions[{k}]: ")
        return _gathered(lanes, t, wanted)

    def step(self, voltages: Given, dt: float) -> BatchRun:
        """One step of each session by ``dt`` [s], from their common time: :meth:`run` to a single time."""
        dt = number("dt", dt, "a time in seconds", above=0.0, most=MAX_STEP)
        now = self.t
        if (now != now[0]).any():
            raise InvalidRequest(f"dt: expected sessions with one time, got {now.min():g} s to {now.max():g} s; run them to one time first")
        count = len(self.sessions)
        spread = {port: value.reshape(count, 1) if value.shape == (count,) else value for port, value in arrays(voltages).items()}
        return self.run([float(now[0]) + dt], spread)

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        """Excludes other threads from the sessions."""
        with contextlib.ExitStack() as locks:
            # in one order, so that two batches with the same sessions do not wait for each other
            for session in sorted(self.sessions, key=id):
                locks.enter_context(session._lock)
            yield

    def _divide(self, lanes: Sequence[Lane], request: Callable[[Sequence[Lane]], None]) -> None:
        """Divides lanes among threads. Returns, or raises, when all of them have ended."""
        parts = workers(self.sessions[0]._channel, len(lanes))
        if parts == 1:
            request(lanes)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(parts, thread_name_prefix="bimorph-batch")
        pool, outer, own = self._pool, current.get(), [Stopping() for _ in range(parts)]

        def stop() -> None:
            for stopping in own:
                stopping.stop()

        if outer is not None:
            outer.begun(stop)
        ends = np.linspace(0, len(lanes), parts + 1).astype(int).tolist()

        results: list[BaseException | None] = []
        wake: queue.SimpleQueue[None] = queue.SimpleQueue()

        def part(k: int) -> None:
            error: BaseException | None = None
            try:
                current.set(own[k])
                request(lanes[ends[k] : ends[k + 1]])
            except BaseException as raised:
                error = raised
            results.append(error)
            wake.put(None)

        def look() -> None:
            # a queue, as a condition breaks where two interrupts meet in its wait; a signal of another thread is handled between two waits
            with contextlib.suppress(queue.Empty):
                wake.get(timeout=_LOOK)

        begun = 0
        try:
            for k in range(parts):
                pool.submit(contextvars.copy_context().run, part, k)
                begun += 1
            while len(results) < parts and all(error is None for error in results):
                look()
            for error in results:
                if error is not None:
                    raise error
        except BaseException:
            stop()
            while len(results) < begun:
                with contextlib.suppress(KeyboardInterrupt):
                    look()
            raise

    def close(self) -> None:
        """Closes every session."""
        for session in self.sessions:
            session.close()
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def __enter__(self) -> Batch:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


def _gathered(lanes: Sequence[Lane], t: Array, wanted: Sequence[str]) -> BatchRun:
    for lane in lanes:
        for rows in (lane.outputs, lane.currents, lane.charges):
            rows[lane.done :] = np.nan
    session = lanes[0].session

    def columns(names: Sequence[str], rows: list[Array]) -> dict[str, Array]:
        return {name: np.stack([lane[:, k] for lane in rows]) for k, name in enumerate(names)}

    return BatchRun(
        t,
        columns(wanted, [lane.outputs for lane in lanes]),
        {name: session.signals[name] for name in wanted},
        columns(session.ports, [lane.currents for lane in lanes]),
        columns(session.ports, [lane.charges for lane in lanes]),
        {k: Failure(lane.done, float(t[lane.done]), lane.error) for k, lane in enumerate(lanes) if lane.error},
    )
