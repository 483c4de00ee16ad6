"""Calls that another thread can stop."""

from __future__ import annotations

import contextlib
import contextvars
import threading
from collections.abc import Callable, Iterator

from .errors import BimorphError


class Stopping:
    """Stops calls that begin while it is :data:`current`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cancels: list[Callable[[], object]] = []
        self._stopped = False

    def begun(self, cancel: Callable[[], object]) -> None:
        """Registers a call, which ``cancel`` ends."""
        with self._lock:
            if not self._stopped:
                # only the last call is running
                self._cancels = [cancel]
                return
        cancel()

    @property
    def stopped(self) -> bool:
        """Whether :meth:`stop` was called."""
        return self._stopped

    def stop(self) -> None:
        """Ends the running call, and each later one at its beginning."""
        with self._lock:
            self._stopped = True
            cancels = self._cancels
        for cancel in cancels:
            cancel()


current: contextvars.ContextVar[Stopping | None] = contextvars.ContextVar("bimorph_stopping", default=None)
"""Handle that stops the calls of this context; None if there is none."""


def check() -> None:
    """Raises :class:`BimorphError` if the calls of this context were stopped; for use between the parts of a call."""
    stopping = current.get()
    if stopping is not None and stopping.stopped:
        raise BimorphError("cancelled: stopped here")


@contextlib.contextmanager
def apart() -> Iterator[None]:
    """Calls within the block cannot be stopped: those that open an object on a server, and those that close it."""
    before = current.set(None)
    try:
        yield
    finally:
        current.reset(before)
