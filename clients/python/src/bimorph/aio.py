"""The package for asyncio: the same names and arguments, to be awaited.

    client = bimorph.aio.Client("unix:///path")          # or bimorph.aio.local()
    model = await client.compile("plate.net")
    run = await model.transient(1e-3, ["m.x"])
    async for row in await client.submit("plate.net", {"gap": [1e-6, 2e-6]}, bimorph.PullIn(30.0)):
        print(row.point, row.results)
    async with await model.session(["m.x"]) as session:
        reply = await session.step({"drive": 3.0}, dt=1e-7)

Each call has a thread while it lasts, which serves a server and models in process alike. A task that is cancelled stops its call: what
computes it ends, on the server too. A step is the exception: it is taken as a whole, and ``session.t`` tells whether it was.
"""

from __future__ import annotations

import asyncio
import contextvars
import os
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

from . import client as _client
from . import model as _model
from . import session as _session
from . import sweep_handle as _sweep_handle
from .local import ADDRESS
from .results import TrialReply
from .stopping import Stopping, current
from .sweep import Row

P = ParamSpec("P")
S = TypeVar("S")
T = TypeVar("T")
W = TypeVar("W")

_AHEAD = 256
"""Most items that an iteration has ahead of who reads them."""


def _thread(run: Callable[[], object]) -> None:
    """Runs in a thread with the context of who calls: a daemon, so that a program that ends does not wait for it."""
    context = contextvars.copy_context()
    threading.Thread(target=context.run, args=(run,), daemon=True).start()


async def _call(call: Callable[[], T]) -> T:
    """Its result, from a thread; cancelled, it is stopped."""
    loop, done, stopping = asyncio.get_running_loop(), asyncio.get_running_loop().create_future(), Stopping()

    def settle(set: Callable[[Any], None], value: Any) -> None:
        if not done.done():
            set(value)

    def tell(set: Callable[[Any], None], value: Any) -> None:
        try:
            loop.call_soon_threadsafe(settle, set, value)
        except RuntimeError:
            pass  # the loop is closed, and nobody waits

    def run() -> None:
        current.set(stopping)
        try:
            tell(done.set_result, call())
        except BaseException as error:
            tell(done.set_exception, error)

    _thread(run)
    try:
        answer: T = await done
        return answer
    except asyncio.CancelledError:
        stopping.stop()
        raise


async def _items(items: Callable[[], Iterator[T]]) -> AsyncIterator[T]:
    """What a generator gives, from a thread, not far ahead; left early, it is stopped."""
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
    """The method of what is wrapped, to be awaited."""

    def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> Awaitable[T]:
        return _call(lambda: method(self.sync, *args, **kwargs))

    call.__doc__, call.__name__ = method.__doc__, method.__name__
    return call


def _awaited_as(wrap: Callable[[T], W], method: Callable[Concatenate[S, P], T]) -> Callable[Concatenate[Any, P], Awaitable[W]]:
    """The same, of what is wrapped in turn."""

    async def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> W:
        return wrap(await _call(lambda: method(self.sync, *args, **kwargs)))

    call.__doc__, call.__name__ = method.__doc__, method.__name__
    return call


class Session:
    """:class:`bimorph.Session` for asyncio."""

    def __init__(self, sync: _session.Session) -> None:
        self.sync = sync
        """What it wraps: ``t``, ``ports``, ``signals`` and the rest of what needs no waiting."""

    trial = _awaited(_session.Session.trial)
    accept = _awaited(_session.Session.accept)
    operating_point = _awaited(_session.Session.operating_point)
    step = _awaited(_session.Session.step)
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

    async def fork(self) -> Session:
        """Another session that goes on from here by itself; close it as well."""
        return Session(await _call(self.sync.fork))

    async def resume(self) -> Session:
        """:meth:`bimorph.Session.resume`."""
        return Session(await _call(self.sync.resume))

    async def __aenter__(self) -> Session:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await _call(self.sync.close)


class Model:
    """:class:`bimorph.Model` for asyncio."""

    def __init__(self, sync: _model.Model) -> None:
        self.sync = sync
        """What it wraps: ``id``, ``ports``, ``nodes``, ``parameters``, ``warnings``."""

    static = _awaited(_model.Model.static)
    modes = _awaited(_model.Model.modes)
    ac = _awaited(_model.Model.ac)
    pull_in = _awaited(_model.Model.pull_in)
    transient = _awaited(_model.Model.transient)
    session = _awaited_as(Session, _model.Model.session)
    restore = _awaited_as(Session, _model.Model.restore)


class Sweep:
    """:class:`bimorph.Sweep` for asyncio: iterated over, it gives its rows, once it is done."""

    def __init__(self, sync: _sweep_handle.Sweep) -> None:
        self.sync = sync
        self.id = sync.id
        """Its name on the server."""

    status = _awaited(_sweep_handle.Sweep.status)
    wait = _awaited(_sweep_handle.Sweep.wait)
    table = _awaited(_sweep_handle.Sweep.table)
    cancel = _awaited(_sweep_handle.Sweep.cancel)

    def watch(self) -> AsyncIterator[_sweep_handle.SweepStatus]:
        """How far it has come, until it ends."""
        return _items(self.sync.watch)

    def __aiter__(self) -> AsyncIterator[Row]:
        return _items(self.sync.rows)

    async def __aenter__(self) -> Sweep:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await _call(lambda: self.sync.__exit__(kind, error, trace))


class Client:
    """:class:`bimorph.Client` for asyncio, with the same arguments."""

    def __init__(self, address: str, timeout: float = 120.0, **access: str | os.PathLike[str] | None) -> None:
        self.sync = _client.Client(address, timeout, **access)  # type: ignore[arg-type]
        """What it wraps."""

    version = _awaited(_client.Client.version)
    settings = _awaited(_client.Client.settings)
    convert = _awaited(_client.Client.convert)
    compile = _awaited_as(Model, _client.Client.compile)
    sweep = _awaited(_client.Client.sweep)
    submit = _awaited_as(Sweep, _client.Client.submit)
    attach = _awaited_as(Sweep, _client.Client.attach)
    resume = _awaited_as(Session, _client.Client.resume)

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.sync.close()


def local() -> Client:
    """Models in this process, :func:`bimorph.local`."""
    return Client(ADDRESS)
