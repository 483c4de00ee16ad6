"""Two concurrent computations, the second of which is useful only with the first."""

from __future__ import annotations

import contextvars
import threading
from collections.abc import Callable
from typing import TypeVar

from .stopping import Stopping, current

A = TypeVar("A")
B = TypeVar("B")


def together(first: Callable[[], A], second: Callable[[], B]) -> tuple[A, B]:
    """Both results. The second call runs in a thread and is stopped if the first fails or is interrupted."""
    stopping, results, errors = Stopping(), list[B](), list[BaseException]()

    def run() -> None:
        current.set(stopping)
        try:
            results.append(second())
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=contextvars.copy_context().run, args=(run,), daemon=True)
    thread.start()
    try:
        found = first()
        thread.join()
    except BaseException:
        stopping.stop()
        thread.join()
        raise
    if errors:
        raise errors[0]
    return found, results[0]
