"""Models in this process, without server and network; calls and errors are those of a server, and results are bit-identical."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from google.protobuf import message_factory

from . import native
from .channel import Channel
from .errors import BimorphError, from_status
from .stopping import current
from .v1 import device_pb2, service_pb2

ADDRESS = "local:"
"""Address of this process."""

_METHODS = service_pb2.DESCRIPTOR.services_by_name["Bimorph"].methods_by_name


def _engine() -> Any:
    return native.of_process("Engine")


class LocalChannel(Channel):
    """Calls to the engine of this process."""

    def __init__(self) -> None:
        super().__init__(ADDRESS, float("inf"))
        self._refusal = native.module().Refusal

    def call(self, method: str, request: Any) -> Any:
        """A call with one reply."""
        stop = self._stop()
        answer = self._guarded(lambda: _engine().call(method, request.SerializeToString(), stop))
        return message_factory.GetMessageClass(_METHODS[method].output_type).FromString(answer)

    def stream(self, method: str, request: Any) -> Iterator[Any]:
        """A call with a stream of replies. Leaving the iteration stops it."""
        answers = self._guarded(lambda: _engine().stream(method, request.SerializeToString()))
        kind, stop = message_factory.GetMessageClass(_METHODS[method].output_type), self._stop()
        try:
            while (answer := self._guarded(lambda: answers.answer(stop))) is not None:
                yield kind.FromString(answer)
        finally:
            answers.cancel()

    def line(self, timeout: float) -> Any:
        """Opens a stream of requests to one device."""
        return LocalLine(self)

    def close(self) -> None:
        """Has no effect: there is no connection."""

    def _stop(self) -> Any:
        """Handle that stops a computation; None where no one can be stopped."""
        stopping = current.get()
        if stopping is None:
            return None
        stop = native.module().Stop()
        stopping.begun(stop.cancel)
        return stop

    def _guarded(self, call: Any) -> Any:
        try:
            return call()
        except self._refusal as error:
            code, text, details = error.args
        raise from_status(code, text, details, self.address)

    def __getstate__(self) -> dict[str, Any]:
        return {}

    def __setstate__(self, state: dict[str, Any]) -> None:
        LocalChannel.__init__(self)


class LocalLine:
    """Requests to one device of this process."""

    def __init__(self, channel: LocalChannel) -> None:
        self._channel = channel
        self._native = _engine().line()
        self.timeout = float("inf")
        self.over: BimorphError | None = None

    def ask(self, request: Any) -> Any:
        """Sends a request and returns its reply."""
        if self.over is not None:
            raise self.over
        reply = self._channel._guarded(lambda: self._native.ask(request.SerializeToString()))
        if reply is None:
            raise self.over or BimorphError("the stream of the session has ended; open another session")
        return device_pb2.DeviceReply.FromString(reply)

    def send(self, request: Any) -> None:
        """Sends a request without a reply."""
        if self.over is not None:
            raise self.over
        self._channel._guarded(lambda: self._native.ask(request.SerializeToString()))

    def close(self, why: BimorphError) -> None:
        """Ends the stream; later requests raise ``why``."""
        self.over = self.over or why
        self._native.close()
