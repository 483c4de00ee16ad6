"""Models in this process: no server and no network, the same calls, the same bits and the same errors."""

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
"""What a client calls this process."""

_METHODS = service_pb2.DESCRIPTOR.services_by_name["Bimorph"].methods_by_name


def _engine() -> Any:
    return native.of_process("Engine")


class LocalChannel(Channel):
    """The way to the models of this process."""

    def __init__(self) -> None:
        super().__init__(ADDRESS, float("inf"))
        self._refusal = native.module().Refusal

    def call(self, method: str, request: Any) -> Any:
        """A call with one answer."""
        stop = self._stop()
        answer = self._guarded(lambda: _engine().call(method, request.SerializeToString(), stop))
        return message_factory.GetMessageClass(_METHODS[method].output_type).FromString(answer)

    def stream(self, method: str, request: Any) -> Iterator[Any]:
        """A call with many answers; left early, it is stopped."""
        answers = self._guarded(lambda: _engine().stream(method, request.SerializeToString()))
        kind, stop = message_factory.GetMessageClass(_METHODS[method].output_type), self._stop()
        try:
            while (answer := self._guarded(lambda: answers.answer(stop))) is not None:
                yield kind.FromString(answer)
        finally:
            answers.cancel()

    def line(self, timeout: float) -> Any:
        """Questions to one device."""
        return LocalLine(self)

    def close(self) -> None:
        """Nothing is open here."""

    def _stop(self) -> Any:
        """What stops a computation, if anything does."""
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
    """Questions to one device of this process."""

    def __init__(self, channel: LocalChannel) -> None:
        self._channel = channel
        self._native = _engine().line()
        self.timeout = float("inf")
        self.over: BimorphError | None = None

    def ask(self, request: Any) -> Any:
        """The reply to a question."""
        if self.over is not None:
            raise self.over
        reply = self._channel._guarded(lambda: self._native.ask(request.SerializeToString()))
        if reply is None:
            raise self.over or BimorphError("the stream of the session has ended; open another session")
        return device_pb2.DeviceReply.FromString(reply)

    def tell(self, request: Any) -> None:
        """Says what has no reply."""
        if self.over is not None:
            raise self.over
        self._channel._guarded(lambda: self._native.ask(request.SerializeToString()))

    def close(self, why: BimorphError) -> None:
        """Ends it: later questions raise ``why``."""
        self.over = self.over or why
        self._native.close()
