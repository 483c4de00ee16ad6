"""Requests to one device and their replies, over a stream of a server.

:class:`NativeLine` uses the native module, whose replies take a fraction of the time. Without it :class:`Line` uses a stream of gRPC.
"""

from __future__ import annotations

import collections
import queue
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import grpc

from . import native
from .errors import BimorphError, UnexpectedReply, Unavailable, from_rpc, from_status
from .v1 import device_pb2

if TYPE_CHECKING:
    from .channel import Channel

_LOOK = 0.2
"""Period at which a waiting call checks whether the stream has ended [s]."""


_UNEXPECTED = "unexpected reply: "
"""Prefix of texts of the native module about unexpected replies."""


class Line:
    """A Trial stream over gRPC.

    Each request has its own queue for the reply, so the reply to an interrupted call is not taken for that of the next one.
    """

    def __init__(self, channel: Channel, timeout: float) -> None:
        """``timeout`` [s] bounds the wait for each reply."""
        self._address = channel.address
        self.timeout = timeout
        """Longest wait for a reply [s]."""
        self._requests: queue.SimpleQueue[_Question | None] = queue.SimpleQueue()
        self._sent: collections.deque[_Question] = collections.deque()
        self.over: BimorphError | None = None
        """Reason for the end of the stream; None while it is open."""
        self._place, stub = channel.place()
        self._call = stub.Trial(self._outgoing(), metadata=channel.metadata)
        self._call.add_callback(self._place.release)
        threading.Thread(target=self._receive, args=(self._call,), daemon=True).start()

    def ask(self, request: Any) -> Any:
        """Sends a request and returns its reply."""
        question = _Question(request, queue.SimpleQueue())
        self._put(question)
        return self._answer(question)

    def send(self, request: Any) -> None:
        """Sends a request without a reply."""
        self._put(_Question(request, None))

    def close(self, why: BimorphError) -> None:
        """Ends the stream; later requests raise ``why``."""
        self.over = self.over or why
        self._requests.put(None)
        self._call.cancel()

    def _put(self, question: _Question) -> None:
        if self.over is not None:
            raise self.over
        self._requests.put(question)

    def _answer(self, question: _Question) -> Any:
        assert question.replies is not None
        deadline = time.monotonic() + self.timeout
        while True:
            left = deadline - time.monotonic()
            try:
                return question.replies.get(timeout=max(min(left, _LOOK), 0.0))
            except queue.Empty:
                if self.over is not None and question.replies.empty():
                    raise self.over from None
                if left <= 0.0:
                    # the server may have processed the request; a kept session can be resumed
                    self.close(Unavailable(f"server {self._address}: no answer within {self.timeout} s"))
                    assert self.over is not None
                    raise self.over from None

    def _outgoing(self) -> Iterator[Any]:
        for question in iter(self._requests.get, None):
            if question.replies is not None:
                self._sent.append(question)
            yield question.request

    def _receive(self, call: Any) -> None:
        # The server sends one reply to each request except accepts, in the order of the requests.
        over: BimorphError
        try:
            for reply in call:
                if not self._sent:
                    self.over = self.over or UnexpectedReply(
                        f"server {self._address}: unexpected reply: no request is open"
                    )
                    call.cancel()
                    return
                replies = self._sent.popleft().replies
                if replies is not None:
                    replies.put(reply)
            over = Unavailable(f"server {self._address}: the stream of the session has ended; open another session (a kept one: resume())")
        except grpc.RpcError as error:
            over = from_rpc(error, self._address)
        self.over = self.over or over


class NativeLine:
    """A Trial stream of the native module, on a connection without TLS that is shared within the process."""

    def __init__(self, channel: Channel, timeout: float) -> None:
        """``timeout`` [s] bounds the wait for each reply."""
        self._address = channel.address
        self.timeout = timeout
        """Longest wait for a reply [s]."""
        self.over: BimorphError | None = None
        """Reason for the end of the stream; None while it is open."""
        self._refusal = native.module().Refusal
        place = channel.native_place()
        # the metadata is set once there is a slot
        shown, connection = dict(channel.metadata or ()).get("authorization"), place.connection
        try:
            self._line = self._guarded(lambda: native.of_process("Servers").line(channel.address, shown, timeout, connection))
        except BaseException:
            place.release()
            raise
        self._release = weakref.finalize(self, place.release)

    def ask(self, request: Any) -> Any:
        """Sends a request and returns its reply."""
        reply = self._said(request)
        if reply is None:
            raise self.over or BimorphError("the stream of the session has ended; open another session")
        return device_pb2.DeviceReply.FromString(reply)

    def send(self, request: Any) -> None:
        """Sends a request without a reply."""
        self._said(request)

    def close(self, why: BimorphError) -> None:
        """Ends the stream; later requests raise ``why``."""
        self.over = self.over or why
        self._line.close()
        self._release()

    def _said(self, request: Any) -> Any:
        if self.over is not None:
            raise self.over
        try:
            return self._guarded(lambda: self._line.ask(request.SerializeToString(), self.timeout))
        except BimorphError as error:
            # the server may have processed the request; a kept session can be resumed
            self.close(error)
            raise

    def _guarded(self, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except self._refusal as error:
            code, text, details = error.args
        if text.startswith(_UNEXPECTED):
            raise UnexpectedReply(f"server {self._address}: {text}")
        raise from_status(code, text, details, self._address)


class _Question(NamedTuple):
    """A request, and the queue for its reply; None for a request without a reply."""

    request: Any
    replies: queue.SimpleQueue[Any] | None
