"""One gRPC channel per process.

gRPC does not survive a fork: a child that uses its parent's channel hangs. So a channel is made when it is first used,
remembers its process, and in another process a new one is made.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import grpc

from .errors import from_rpc
from .v1 import service_pb2_grpc

T = TypeVar("T")

_OPTIONS = [
    ("grpc.max_receive_message_length", 64 << 20),
    ("grpc.max_send_message_length", 64 << 20),
    # For a Unix socket gRPC would send the escaped path as HTTP authority, which the server's HTTP layer refuses.
    ("grpc.default_authority", "localhost"),
    # Channels to one address share a connection otherwise, and a forked child would get its parent's.
    ("grpc.use_local_subchannel_pool", 1),
]


class Channel:
    """The connection to one server, made when first used."""

    def __init__(self, address: str, timeout: float) -> None:
        self.address = address
        self.timeout = timeout
        self._pid: int | None = None
        self._channel: grpc.Channel | None = None
        self._stub: Any = None

    @property
    def stub(self) -> Any:
        """The stub of this process."""
        if self._pid != os.getpid():
            # A channel of another process is left alone: closing it here could hang.
            target = self.address
            for scheme in ("http://", "grpc://"):
                target = target.removeprefix(scheme)
            self._channel = grpc.insecure_channel(target, options=_OPTIONS)
            self._stub = service_pb2_grpc.BimorphStub(self._channel)
            self._pid = os.getpid()
        return self._stub

    def call(self, method: str, request: Any) -> Any:
        """A unary call within the timeout."""
        return self.guard(lambda: getattr(self.stub, method)(request, timeout=self.timeout))

    def stream(self, method: str, request: Any) -> Iterator[Any]:
        """A call with many answers; left early, it is cancelled."""
        call = self.guard(lambda: getattr(self.stub, method)(request))
        try:
            while True:
                try:
                    yield next(call)
                except StopIteration:
                    return
                except grpc.RpcError as error:
                    raise from_rpc(error, self.address) from None
        finally:
            call.cancel()

    def guard(self, call: Callable[[], T]) -> T:
        """Turns a status into an error of this package."""
        try:
            return call()
        except grpc.RpcError as error:
            raise from_rpc(error, self.address) from None

    def close(self) -> None:
        """Closes the connection of this process."""
        if self._channel is not None and self._pid == os.getpid():
            self._channel.close()
        self._pid = self._channel = self._stub = None
