"""The native module of this package, which is optional, and its objects in each process."""

from __future__ import annotations

import functools
import importlib
import os
import threading
from typing import Any

from .errors import BimorphError

_lock = threading.Lock()
_made: dict[tuple[int, str], Any] = {}
"""Objects with threads, by process, as threads do not survive a fork. Objects of parent processes are neither used nor released."""


@functools.cache
def _loaded() -> tuple[Any, ImportError | None]:
    """The module, or the error of its import."""
    try:
        return importlib.import_module("bimorph._native"), None
    except ImportError as error:
        return None, error


def found() -> Any:
    """The module; None if it is not installed or cannot be loaded."""
    return _loaded()[0]


def module() -> Any:
    """The module.

    Raises :class:`BimorphError` if it is not installed or cannot be loaded.
    """
    loaded, error = _loaded()
    if loaded is not None:
        return loaded
    if isinstance(error, ModuleNotFoundError):
        raise BimorphError("this package has no models in process; install a wheel of `make wheel`, or use bimorph.serve()")
    raise BimorphError(f"the models in process of this package cannot be loaded ({error}); use bimorph.serve()") from error


def of_process(kind: str) -> Any:
    """The object of a class of the module in this process, created at first use."""
    key = (os.getpid(), kind)
    made = _made.get(key)
    if made is None:
        with _lock:
            made = _made.get(key)
            if made is None:
                made = _made[key] = getattr(module(), kind)()
    return made


def _forked() -> None:
    global _lock
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)
