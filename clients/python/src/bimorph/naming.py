"""Names of arguments in errors of the server, whose protocol uses other names for some of them."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from typing import TypeVar

from .errors import InvalidRequest, LimitExceeded, NotFound

T = TypeVar("T")

_PORT = (r'(voltage of )?port "|no port named', "voltages")
_SIGNAL = (r'signal "|no signal named', "signals")
_RULES: dict[str, tuple[tuple[str, str], ...]] = {
    "Static": (_PORT,),
    "Modes": (_PORT, ("modes:", "count")),
    "FrequencyResponse": (_PORT, _SIGNAL, ("from:", "start"), ("to:", "stop")),
    "Export": (_PORT, _SIGNAL, ("to_hz:", "to"), ("modes:|mode_work:", "count")),
    "Path": (_PORT, _SIGNAL, ("from:", "start"), ("to:", "stop"), ("message_bytes:", "points")),
    "Transient": (_PORT, _SIGNAL, ("stop_s:", "stop"), ("release_model", "release"), ("step_s:", "step")),
    "Open": ((_PORT[0], "ports"), _SIGNAL, ("noise band:", "noise_band")),
    "SubmitJob": (("release_after_s:", "release_after"), (r"(spec\.)?parameter", "parameters"), (r"(spec\.)?sample", "samples")),
    "Compile": ((r"options\.band_hz:", "band"),),
    "GetJob": (("no job", "sweep"),),
}
"""By method of the protocol: the beginning of a message, and its argument."""


@contextlib.contextmanager
def by_argument(method: str, *more: tuple[str, str]) -> Iterator[None]:
    """Within the block, errors of calls of this method begin with the name of the argument."""
    try:
        yield
        return
    except (InvalidRequest, LimitExceeded, NotFound) as error:
        failure = error
    rules = (*more, *_RULES.get(method, ()))
    name = next((name for begin, name in rules if re.match(begin, str(failure))), None)
    if name is not None and not str(failure).startswith(name) and type(failure) in (InvalidRequest, LimitExceeded, NotFound):
        violations = (failure.violations,) if isinstance(failure, InvalidRequest) else ()
        raise type(failure)(f"{name}: {failure}", *violations)
    raise failure


def each(method: str, replies: Iterator[T], *more: tuple[str, str]) -> Iterator[T]:
    """Replies of a streaming call, with errors as in :func:`by_argument`."""
    with by_argument(method, *more):
        yield from replies
