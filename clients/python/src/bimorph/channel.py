"""One gRPC channel per process and server, shared by all who talk to that server.

gRPC does not survive a fork: a child that uses its parent's channel hangs. So a channel is made when it is first used, and in
another process a new one is made. Clients and models that were sent to a worker process share its channel, however many of
them come: a server has a bounded number of connections.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import os
import threading
import time
import warnings
import weakref
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import grpc

from . import native
from .access import Access, is_secure, target
from .errors import BimorphError, Unavailable, from_rpc
from .line import Line, NativeLine
from .stopping import current
from .v1 import model_pb2, service_pb2_grpc

T = TypeVar("T")

_ATTEMPTS = 6
"""Attempts in a row without a word, after which a server is given up."""

_PAUSE = 0.1
"""Pause before the second attempt [s]; each further one is twice as long."""

_OPTIONS = [
    ("grpc.max_receive_message_length", 64 << 20),
    ("grpc.max_send_message_length", 64 << 20),
    # A network that fails without a word is noticed by a ping that is not answered, within 4.5 s, whatever is being waited for.
    ("grpc.keepalive_time_ms", 2000),
    ("grpc.http2.ping_timeout_ms", 2500),
    ("grpc.http2.max_pings_without_data", 0),
    # One that works again is used soon.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 2000),
    # Channels to one address share a connection otherwise, and a forked child would get its parent's.
    ("grpc.use_local_subchannel_pool", 1),
]


# For a Unix socket gRPC would send the escaped path as HTTP authority, which the server's HTTP layer refuses.
_PLAIN = [*_OPTIONS, ("grpc.default_authority", "localhost")]


class _Connection:
    """A gRPC channel of this process; closed when nobody holds it any more."""

    def __init__(self, address: str, access: Access) -> None:
        self._pid = os.getpid()
        self._channel: Any = None
        if is_secure(address):
            credentials = grpc.ssl_channel_credentials(*access.certificates())
            self._channel = grpc.secure_channel(target(address), credentials, options=_OPTIONS)
        else:
            self._channel = grpc.insecure_channel(target(address), options=_PLAIN)
        self.stub: Any = service_pb2_grpc.BimorphStub(self._channel)
        self.compared = False
        """Whether the server's version was looked at."""
        # When nobody has it any more. A method ``__del__`` would let another thread find it in ``_connections`` while it closes.
        weakref.finalize(self, _close, self._channel, self._pid)


def _close(channel: Any, pid: int) -> None:
    # A channel of another process is left alone: closing it here could hang.
    if pid == os.getpid():
        channel.close()


_connections: weakref.WeakValueDictionary[tuple[str, Access], _Connection] = weakref.WeakValueDictionary()
_lock = threading.Lock()
_inherited: list[Any] = []


def _forked() -> None:
    """In a child: nothing of the parent's is used, or even let go of."""
    global _connections, _lock
    _inherited.append(list(_connections.values()))
    _connections = weakref.WeakValueDictionary()
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def _connect(address: str, access: Access) -> _Connection:
    with _lock:
        connection = _connections.get((address, access))
        if connection is None:
            connection = _connections[address, access] = _Connection(address, access)
        return connection


OWN = importlib.metadata.version("bimorph-mems")
"""The version of this package."""

_told: set[tuple[str, str]] = set()
"""Servers and their versions that this process was warned of."""


class Channel:
    """The way to one server, connected when first used."""

    def __init__(self, address: str, timeout: float, access: Access | None = None) -> None:
        self.address = address
        self.timeout = timeout
        self._access = access or Access()
        self.metadata: tuple[tuple[str, str], ...] | None = None
        """What every call carries; known once the stub is."""
        self._pid: int | None = None
        self._connection: _Connection | None = None

    @property
    def stub(self) -> Any:
        """The stub of this process."""
        connection = self._connection
        if connection is None or self._pid != os.getpid():
            access = self._access.with_environment()
            self.metadata = access.metadata(self.address)
            self._connection = connection = _connect(self.address, access)
            self._pid = os.getpid()
        return connection.stub

    def call(self, method: str, request: Any) -> Any:
        """A unary call within the timeout."""
        ask, stopping = getattr(self.stub, method), current.get()

        def wait() -> Any:
            if stopping is None:
                return ask(request, timeout=self.timeout, metadata=self.metadata)
            future = ask.future(request, timeout=self.timeout, metadata=self.metadata)
            stopping.begun(future.cancel)
            return future.result()

        answer = self.guard(wait)
        connection = self._connection
        if connection is not None and not connection.compared:
            connection.compared = True
            self._compare(answer if method == "Info" else None)
        return answer

    def _compare(self, info: Any) -> None:
        """Warns once of a server of another version: its numbers may differ, and its states cannot be gone on from."""
        if info is None:
            with contextlib.suppress(BimorphError):
                info = self.call("Info", model_pb2.InfoRequest())
        if info is None or info.version == OWN or (self.address, info.version) in _told:
            return
        _told.add((self.address, info.version))
        text = f"server {self.address} is of version {info.version}, this client of {OWN}: numbers and options may differ"
        warnings.warn(text, stacklevel=4)

    def stream(self, method: str, request: Any) -> Iterator[Any]:
        """A call with many answers; left early, it is cancelled."""
        stub = self.stub
        call = self.guard(lambda: getattr(stub, method)(request, metadata=self.metadata))
        stopping = current.get()
        if stopping is not None:
            stopping.begun(call.cancel)
        try:
            while True:
                try:
                    yield next(call)
                    continue
                except StopIteration:
                    return
                except grpc.RpcError as error:
                    failure = from_rpc(error, self.address)
                raise failure
        finally:
            call.cancel()

    def line(self, timeout: float) -> Line | NativeLine:
        """Questions to one device, each with a reply within ``timeout`` [s]."""
        if is_secure(self.address) or native.found() is None:
            return Line(self, timeout)
        # what every call carries is known once the stub is
        _ = self.stub
        return NativeLine(self, timeout)

    def persist(self, ask: Callable[[Callable[[], None]], T]) -> T:
        """Asks again where the network fails. ``ask`` is given what to call when it hears that things go on.

        For questions alone that may be asked twice.
        """
        failures = 0

        def heard() -> None:
            nonlocal failures
            failures = 0

        while True:
            try:
                return ask(heard)
            except Unavailable:
                failures += 1
                if failures >= _ATTEMPTS:
                    raise
            time.sleep(_PAUSE * 2 ** (failures - 1))

    def guard(self, call: Callable[[], T]) -> T:
        """Turns a status into an error of this package.

        It is raised outside of the handler: gRPC's own error, which cannot be pickled, must not come along as its context.
        """
        try:
            return call()
        except grpc.FutureCancelledError:
            failure = BimorphError("cancelled: stopped here")
        except grpc.RpcError as error:
            failure = from_rpc(error, self.address)
        raise failure

    def close(self) -> None:
        """Lets go of the connection of this process; it closes when nobody else uses it."""
        self._connection = None

    def __getstate__(self) -> dict[str, Any]:
        return {"address": self.address, "timeout": self.timeout, "access": self._access}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["address"], state["timeout"], state["access"])  # type: ignore[misc]
