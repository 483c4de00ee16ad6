"""One gRPC channel per process and server, shared by all clients of that server.

gRPC does not survive a fork: a child that uses its parent's channel hangs. So a channel is opened at first use, again
in each process. All clients and models that were sent to a worker process share its channel, because a server accepts a bounded number
of connections.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import math
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
from .stopping import check, current
from .streams import Place, Places
from .v1 import model_pb2, service_pb2_grpc

T = TypeVar("T")

_ATTEMPTS = 6
"""Attempts in a row before a server that has never replied is given up."""

_PAUSE = 0.1
"""Pause before the second attempt [s]; each further one is twice as long."""
_LONGEST_PAUSE = 1.0
"""Longest of these pauses [s]."""

_OPTIONS = [
    ("grpc.max_receive_message_length", 64 << 20),
    ("grpc.max_send_message_length", 64 << 20),
    # A silent failure of the network is detected by a ping without a reply, within 4.5 s.
    ("grpc.keepalive_time_ms", 2000),
    ("grpc.http2.ping_timeout_ms", 2500),
    ("grpc.http2.max_pings_without_data", 0),
    # Reconnect soon after the network works again.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 2000),
    # Channels to one address share a connection otherwise, and a forked child would get its parent's.
    ("grpc.use_local_subchannel_pool", 1),
]


# For a Unix socket gRPC would send the escaped path as HTTP authority, which the server's HTTP layer rejects.
_PLAIN = [*_OPTIONS, ("grpc.default_authority", "localhost")]


class _Connection:
    """The gRPC channels of this process to one server; a further one is opened when the others are full of streams. Closed when unused."""

    def __init__(self, address: str, access: Access) -> None:
        self._pid = os.getpid()
        self._address, self._access = address, access
        self._channels: list[Any] = []
        self._stubs: list[Any] = []
        self._lock = threading.Lock()
        self.compared = False
        """Whether the server's version is known."""
        self.answered = False
        """Whether the server has replied to a call."""
        self.places = Places()
        """Stream slots of each channel."""
        self.native_places = Places()
        """Stream slots of each connection of the native module."""
        # A method ``__del__`` would let another thread find it in ``_connections`` while it closes.
        weakref.finalize(self, _close, self._channels, self._pid)
        self.stub: Any = self.stub_of(0)
        """Calls over the first channel."""

    def stub_of(self, number: int) -> Any:
        """Calls over one of the channels."""
        with self._lock:
            while len(self._stubs) <= number:
                channel = self._open()
                self._channels.append(channel)
                self._stubs.append(service_pb2_grpc.BimorphStub(channel))
            return self._stubs[number]

    def _open(self) -> Any:
        address, access = self._address, self._access
        if is_secure(address):
            credentials = grpc.ssl_channel_credentials(*access.certificates())
            return grpc.secure_channel(target(address), credentials, options=_OPTIONS)
        return grpc.insecure_channel(target(address), options=_PLAIN)


def _close(channels: list[Any], pid: int) -> None:
    # A channel of another process is left alone: closing it here could hang.
    if pid == os.getpid():
        for channel in channels:
            channel.close()


_connections: weakref.WeakValueDictionary[tuple[str, Access], _Connection] = weakref.WeakValueDictionary()
_lock = threading.Lock()
_inherited: list[Any] = []


def _forked() -> None:
    """In a forked child: connections of the parent are neither used nor closed."""
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
"""Servers and versions for which this process has issued the warning."""


class Channel:
    """Calls to one server, connected at first use."""

    def __init__(self, address: str, timeout: float, access: Access | None = None) -> None:
        self.address = address
        self.timeout = timeout
        self.reconnect = timeout
        """Longest time of attempts to reach a server that has replied before [s]."""
        self._access = access or Access()
        self.metadata: tuple[tuple[str, str], ...] | None = None
        """Metadata of every call; set with the stub."""
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
            timeout = None if self.timeout == math.inf else self.timeout
            if stopping is None:
                return ask(request, timeout=timeout, metadata=self.metadata)
            future = ask.future(request, timeout=timeout, metadata=self.metadata)
            stopping.begun(future.cancel)
            return future.result()

        answer = self.guard(wait)
        connection = self._connection
        if connection is not None:
            connection.answered = True
        if connection is not None and not connection.compared:
            connection.compared = True
            self._compare(answer if method == "Info" else None)
        return answer

    def _compare(self, info: Any) -> None:
        """Warns once about a server of another version: its results may differ, and its states cannot be restored."""
        if info is None:
            with contextlib.suppress(BimorphError):
                info = self.call("Info", model_pb2.InfoRequest())
        connection = self._connection
        if info is not None and connection is not None:
            for one in info.settings:
                if one.name == "streams_per_connection" and one.value.isdecimal():
                    connection.places.limit = connection.native_places.limit = max(int(one.value), 1)
        if info is None or info.version == OWN or (self.address, info.version) in _told:
            return
        _told.add((self.address, info.version))
        text = f"server {self.address} is of version {info.version}, this client of {OWN}: numbers and options may differ"
        warnings.warn(text, stacklevel=4)

    def stream(self, method: str, request: Any) -> Iterator[Any]:
        """A call with a stream of replies. Leaving the iteration cancels it."""
        place, stub = self.place()
        try:
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
        finally:
            place.release()

    def place(self) -> tuple[Place, Any]:
        """A stream slot, and the stub of its channel."""
        _ = self.stub
        connection = self._connection
        assert connection is not None
        place = connection.places.take()
        try:
            return place, connection.stub_of(place.connection)
        except BaseException:
            place.release()
            raise

    def native_place(self) -> Place:
        """A stream slot on a connection of the native module."""
        _ = self.stub
        assert self._connection is not None
        return self._connection.native_places.take()

    def line(self, timeout: float) -> Line | NativeLine:
        """Opens a stream of requests to one device, each with a reply within ``timeout`` [s]."""
        if is_secure(self.address) or native.found() is None:
            return Line(self, timeout)
        return NativeLine(self, timeout)

    def persist(self, ask: Callable[[], T], within: float | None = None) -> T:
        """Repeats a call while the network fails, for ``within`` [s], by default :attr:`reconnect`. A server that has never replied to
        this process is given up after six attempts: its address may be wrong.

        Only for calls that may be repeated.
        """
        deadline, failures = time.monotonic() + (self.reconnect if within is None else within), 0
        while True:
            try:
                return ask()
            except Unavailable:
                failures += 1
                pause = min(_PAUSE * 2 ** (failures - 1), _LONGEST_PAUSE)
                known = within is not None or (self._connection is not None and self._connection.answered)
                if time.monotonic() + pause >= deadline or not known and failures >= _ATTEMPTS:
                    raise
            check()
            time.sleep(pause)

    def guard(self, call: Callable[[], T]) -> T:
        """Converts a gRPC status into an error of this package.

        It is raised outside of the handler: the error of gRPC cannot be pickled and must not be its context.
        """
        try:
            return call()
        except grpc.FutureCancelledError:
            failure = BimorphError("cancelled: stopped here")
        except grpc.RpcError as error:
            failure = from_rpc(error, self.address)
        raise failure

    def close(self) -> None:
        """Releases the connection of this process, which closes when no other client uses it."""
        self._connection = None

    def __getstate__(self) -> dict[str, Any]:
        return {"address": self.address, "timeout": self.timeout, "access": self._access, "reconnect": self.reconnect}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["address"], state["timeout"], state["access"])  # type: ignore[misc]
        self.reconnect = state["reconnect"]
