"""Calls that somebody else may stop."""

from __future__ import annotations

import contextlib
import contextvars
import threading
from collections.abc import Callable, Iterator

from .errors import BimorphError


class Stopping:
    """Stops the calls that are begun while it is :data:`current`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cancels: list[Callable[[], object]] = []
        self._stopped = False

    def begun(self, cancel: Callable[[], object]) -> None:
        """A call was begun, which ``cancel`` ends."""
        with self._lock:
            if not self._stopped:
                # the last one is under way, those before have ended
                self._cancels = [cancel]
                return
        cancel()

    @property
    def stopped(self) -> bool:
        """Whether somebody has stopped it."""
        return self._stopped

    def stop(self) -> None:
        """Ends what is under way, and whatever is begun later."""
        with self._lock:
            self._stopped = True
            cancels = self._cancels
        for cancel in cancels:
            cancel()


current: contextvars.ContextVar[Stopping | None] = contextvars.ContextVar("bimorph_stopping", default=None)
"""What stops the calls of this context; None: nothing but themselves."""


def check() -> None:
    """Raises :class:`BimorphError` where the calls of this context were stopped: between the parts of what is computed in many."""
    stopping = current.get()
    if stopping is not None and stopping.stopped:
        raise BimorphError("cancelled: stopped here")


@contextlib.contextmanager
def apart() -> Iterator[None]:
    """Calls that nobody stops: those that make something on a server, whose answer says what is to be closed, and those that close it."""
    before = current.set(None)
    try:
        yield
    finally:
        current.reset(before)
