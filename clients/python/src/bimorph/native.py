"""The module of this package that is not Python, where it was installed with it; and what of it each process has for itself."""

from __future__ import annotations

import functools
import importlib
import os
import threading
from typing import Any

from .errors import BimorphError

_lock = threading.Lock()
_made: dict[tuple[int, str], Any] = {}
"""By process: what has threads, which no fork takes along. Those of parents are never used, nor let go of."""


@functools.cache
def found() -> Any:
    """The module; None where the package was installed without it."""
    try:
        return importlib.import_module("bimorph._native")
    except ImportError:
        return None


def module() -> Any:
    """The module.

    Raises :class:`BimorphError` where the package was installed without it.
    """
    if found() is None:
        raise BimorphError("this package has no models in process: install one that `make wheel` made, or use bimorph.serve()")
    return found()


def of_process(kind: str) -> Any:
    """The one object of a class of the module that this process has."""
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
