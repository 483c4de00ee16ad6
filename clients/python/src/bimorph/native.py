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
def _loaded() -> tuple[Any, ImportError | None]:
    """The module, or why it cannot be loaded."""
    try:
        return importlib.import_module("bimorph._native"), None
    except ImportError as error:
        return None, error


def found() -> Any:
    """The module; None where the package was installed without it, or it cannot be loaded."""
    return _loaded()[0]


def module() -> Any:
    """The module.

    Raises :class:`BimorphError` where the package was installed without it, or it cannot be loaded.
    """
    loaded, error = _loaded()
    if loaded is not None:
        return loaded
    if isinstance(error, ModuleNotFoundError):
        raise BimorphError("this package has no models in process; install a wheel of `make wheel`, or use bimorph.serve()")
    raise BimorphError(f"the models in process of this package cannot be loaded ({error}); use bimorph.serve()") from error


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
