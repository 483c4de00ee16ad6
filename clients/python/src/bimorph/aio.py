"""The package for asyncio: the same names and arguments, as coroutines.

    client = bimorph.aio.Client("unix:///path")          # or bimorph.aio.local()
    model = await client.compile("plate.net")
    run = await model.transient(1e-3, ["m.x"])
    async for row in await client.submit("plate.net", {"gap": [1e-6, 2e-6]}, bimorph.PullIn(30.0)):
        print(row.point, row.results)
    async with await model.session(["m.x"]) as session:
        reply = await session.step({"drive": 3.0}, dt=1e-7)

Each call runs in a thread of its own, on servers and in process. Cancelling a task stops its call: the computation ends, on the server
too, and a session or sweep that the call was opening is closed. A piece of a step and an equilibrium run to their end. A step is taken
as a whole or not at all; ``session.t`` shows which.
"""

from __future__ import annotations

import asyncio
import contextlib
import contextvars
import os
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from types import TracebackType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from . import client as _client
from . import model as _model
from . import session as _session
from . import sweep_handle as _sweep_handle
from .errors import Diagnostic
from .local import ADDRESS
from .trial_reply import TrialReply
from .stopping import Stopping, current
from .table import Row

P = ParamSpec("P")
S = TypeVar("S")
T = TypeVar("T")
W = TypeVar("W")
C = TypeVar("C", bound="contextlib.AbstractContextManager[Any]")
B = TypeVar("B", bound="_Block[Any]")

_AHEAD = 256
"""Most items that an iterator reads ahead of its consumer."""


def _thread(run: Callable[[], object]) -> None:
    """Runs in a daemon thread with the caller's context, so that the end of the program does not wait for it."""
    context = contextvars.copy_context()
    threading.Thread(target=context.run, args=(run,), daemon=True).start()


def _nothing(result: object) -> None:
    """Default of ``drop``: most results hold no resource."""


async def _call(call: Callable[[], T], drop: Callable[[T], object] = _nothing) -> T:
    """Result of ``call``, run in a thread. On cancellation the call is stopped, and a result that arrives all the same is passed to ``drop``."""
    loop, done, stopping = asyncio.get_running_loop(), asyncio.get_running_loop().create_future(), Stopping()
    lock, left, made = threading.Lock(), threading.Event(), list[T]()

    def settle(set: Callable[[Any], None], value: Any) -> None:
        if not done.done():
            set(value)

    def deliver(set: Callable[[Any], None], value: Any) -> None:
        try:
            loop.call_soon_threadsafe(settle, set, value)
        except RuntimeError:
            pass  # the loop is closed

    def run() -> None:
        current.set(stopping)
        try:
            result = call()
            with lock:
                made.append(result)
                late = left.is_set()
            if late:
                drop(result)
            else:
                deliver(done.set_result, result)
        except BaseException as error:
            deliver(done.set_exception, error)

    _thread(run)
    try:
        answer: T = await done
        return answer
    except asyncio.CancelledError:
        stopping.stop()
        with lock:
            left.set()
            ready = bool(made)
        if ready:
            # the result was ready; a later one is dropped by the thread
            _thread(lambda: drop(made[0]))
        raise


async def _items(items: Callable[[], Iterator[T]]) -> AsyncIterator[T]:
    """Items of a generator that runs in a thread, read ahead by a bounded number. Leaving the iteration stops the generator."""
    loop, stopping = asyncio.get_running_loop(), Stopping()
    queue: asyncio.Queue[tuple[T | None, BaseException | None]] = asyncio.Queue()
    room = threading.Semaphore(_AHEAD)
    left = threading.Event()

    def put(item: T | None, error: BaseException | None) -> None:
        try:
            loop.call_soon_threadsafe(queue.put_nowait, (item, error))
        except RuntimeError:
            left.set()

    def run() -> None:
        current.set(stopping)
        try:
            for item in items():
                room.acquire()
                if left.is_set():
                    return
                put(item, None)
            put(None, StopAsyncIteration())
        except BaseException as error:
            put(None, error)

    _thread(run)
    try:
        while True:
            item, error = await queue.get()
            if isinstance(error, StopAsyncIteration):
                return
            if error is not None:
                raise error
            room.release()
            yield item  # type: ignore[misc]
    finally:
        left.set()
        stopping.stop()
        room.release()


def _awaited(method: Callable[Concatenate[S, P], T]) -> Callable[Concatenate[Any, P], Awaitable[T]]:
    """Method of the wrapped object as a coroutine."""

    def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> Awaitable[T]:
        return _call(lambda: method(self.sync, *args, **kwargs))

    call.__doc__, call.__name__ = method.__doc__, method.__name__
    return call


def _awaited_as(
    wrap: Callable[[T], W], method: Callable[Concatenate[S, P], T], drop: Callable[[T], object] = _nothing
) -> Callable[Concatenate[Any, P], Awaitable[W]]:
    """As :func:`_awaited`, with the result wrapped; ``drop`` ends a result that arrives after cancellation."""

    async def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> W:
        return wrap(await _call(lambda: method(self.sync, *args, **kwargs), drop))

    call.__doc__, call.__name__ = method.__doc__, method.__name__
    return call


class _Block(Generic[C]):
    """An object for ``async with``; the end of the block ends the wrapped object."""

    def __init__(self, sync: C) -> None:
        self.sync = sync
        """The wrapped object, for attributes without waiting: ``t``, ``ports``, ``address``, …"""

    async def __aenter__(self: B) -> B:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await _call(lambda: self.sync.__exit__(kind, error, trace))


class Session(_Block[_session.Session]):
    """:class:`bimorph.Session` for asyncio."""

    trial = _awaited(_session.Session.trial)
    accept = _awaited(_session.Session.accept)
    operating_point = _awaited(_session.Session.operating_point)
    step = _awaited(_session.Session.step)
    run = _awaited(_session.Session.run)
    linearize = _awaited(_session.Session.linearize)
    noise = _awaited(_session.Session.noise)
    snapshot = _awaited(_session.Session.snapshot)
    close = _awaited(_session.Session.close)

    @property
    def t(self) -> float:
        """Time of the accepted state [s]."""
        return self.sync.t

    @property
    def accepted(self) -> TrialReply | None:
        """The accepted state; None: the model at rest as drawn."""
        return self.sync.accepted

    async def warnings(self) -> tuple[Diagnostic, ...]:
        """:attr:`bimorph.Session.warnings`."""
        return await _call(lambda: self.sync.warnings)

    async def fork(self) -> Session:
        """Opens another session with the same states; close it as well."""
        return Session(await _call(self.sync.fork, _session.Session.close))

    async def resume(self) -> Session:
        """:meth:`bimorph.Session.resume`."""

        def back(other: _session.Session) -> None:
            other.leave()
            self.sync._joined = True

        return Session(await _call(self.sync.resume, back))


class Model:
    """:class:`bimorph.Model` for asyncio."""

    def __init__(self, sync: _model.Model) -> None:
        self.sync = sync
        """The wrapped model: ``id``, ``ports``, ``nodes``, ``parameters``, ``warnings``."""

    static = _awaited(_model.Model.static)
    modes = _awaited(_model.Model.modes)
    ac = _awaited(_model.Model.ac)
    pull_in = _awaited(_model.Model.pull_in)
    path = _awaited(_model.Model.path)
    export = _awaited(_model.Model.export)
    transient = _awaited(_model.Model.transient)
    session = _awaited_as(Session, _model.Model.session, _session.Session.close)
    restore = _awaited_as(Session, _model.Model.restore, _session.Session.close)


class Sweep(_Block[_sweep_handle.Sweep]):
    """:class:`bimorph.Sweep` for asyncio. Iteration yields its rows in the order in which they finish."""

    def __init__(self, sync: _sweep_handle.Sweep) -> None:
        super().__init__(sync)
        self.id = sync.id
        """Name on the server."""

    status = _awaited(_sweep_handle.Sweep.status)
    wait = _awaited(_sweep_handle.Sweep.wait)
    table = _awaited(_sweep_handle.Sweep.table)
    cancel = _awaited(_sweep_handle.Sweep.cancel)
    delete = _awaited(_sweep_handle.Sweep.delete)

    def rows(self, first: int = 0) -> AsyncIterator[Row]:
        """Rows in the order in which they finish, from number ``first`` on."""
        return _items(lambda: self.sync.rows(first))

    def watch(self) -> AsyncIterator[_sweep_handle.SweepStatus]:
        """Its status after each change, until it ends."""
        return _items(self.sync.watch)

    def __aiter__(self) -> AsyncIterator[Row]:
        return _items(self.sync.rows)


class Client(_Block[_client.Client]):
    """:class:`bimorph.Client` for asyncio, with the same arguments."""

    def __init__(self, address: str, timeout: float = 120.0, **access: str | os.PathLike[str] | None) -> None:
        super().__init__(_client.Client(address, timeout, **access))  # type: ignore[arg-type]

    version = _awaited(_client.Client.version)
    settings = _awaited(_client.Client.settings)
    convert = _awaited(_client.Client.convert)
    compile = _awaited_as(Model, _client.Client.compile)
    sweep = _awaited(_client.Client.sweep)
    submit = _awaited_as(Sweep, _client.Client.submit, lambda sweep: sweep.__exit__(None, None, None))
    attach = _awaited_as(Sweep, _client.Client.attach)
    sweeps = _awaited(_client.Client.sweeps)
    resume = _awaited_as(Session, _client.Client.resume, _session.Session.leave)


def local() -> Client:
    """Models in this process, :func:`bimorph.local`."""
    return Client(ADDRESS)
