"""Checks of the arguments of public functions, made before anything is sent. An error names the argument, the expected value and the given one.

NumPy numbers are converted exactly (a ``float32`` to the ``float64`` of the same value). Text, bytes, flags and arrays are not numbers.
"""

from __future__ import annotations

import math
import numbers
import os
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, TypeVar, get_args, get_origin

import numpy as np

from .errors import InvalidRequest, InvalidType

K = TypeVar("K")
V = TypeVar("V")
C = TypeVar("C", bound=Callable[..., object])
T = TypeVar("T")

MAX_ITEMS = 10_000_000
"""Most items of an iterable argument; an endless one is rejected."""
MAX_STEP = 1e9
"""Longest step of a device [s]."""
MAX_TIMEOUT = 1e8
"""A longer timeout [s] is taken as infinite."""


def shown(value: object) -> str:
    """A value as text for a message: short, on one line."""
    try:
        text = reprlib.repr(value)
    except Exception:
        return f"an object of type {type(value).__name__}"
    return text if len(text) <= 200 else f"{text[:200]}…"


def wrong(name: str, expected: str, value: object) -> InvalidRequest:
    """Error for a value outside its range."""
    return InvalidRequest(f"{name}: expected {expected}, got {shown(value)}")


def wrong_type(name: str, expected: str, value: object) -> InvalidType:
    """Error for a value of another type."""
    return InvalidType(f"{name}: expected {expected}, got {shown(value)}")


def number(
    name: str,
    value: Any,
    what: str = "a finite number",
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    below: float = math.inf,
    most: float = math.inf,
) -> float:
    """A finite number in a range."""
    if type(value) is not float:
        value = _real(name, value, what)
    if not (math.isfinite(value) and value > above and value >= least and value < below and value <= most):
        bounds = [f"above {above:g}"] * (above > -math.inf) + [f"of at least {least:g}"] * (least > -math.inf)
        bounds += [f"below {below:g}"] * (below < math.inf) + [f"at most {most:g}"] * (most < math.inf)
        raise wrong(name, " ".join([what, " and ".join(bounds)]).rstrip(), value)
    found: float = value
    return found


def _real(name: str, value: Any, what: str) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise wrong_type(name, what, value)
    try:
        return float(value)
    except (OverflowError, ValueError):
        raise wrong(name, what, value) from None


def integer(name: str, value: Any, least: int = 0, most: int = (1 << 31) - 1) -> int:
    """An integer in a range; floats are rejected, also whole ones."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
        raise wrong_type(name, f"an integer of at least {least}", value)
    found = int(value)
    if found < least:
        raise wrong(name, f"at least {least}", value)
    if found > most:
        raise wrong(name, f"at most {most}", value)
    return found


def timeout(name: str, value: Any) -> float:
    """A time above 0 [s]; infinite for no timeout."""
    if isinstance(value, (float, np.floating)) and value == math.inf:
        return math.inf
    found = number(name, value, "a time in seconds", above=0.0)
    return found if found <= MAX_TIMEOUT else math.inf


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise wrong_type(name, "True or False", value)
    return bool(value)


def text(name: str, value: Any, what: str = "a text", *, empty: bool = False) -> str:
    """A text that has a UTF-8 encoding, without NUL."""
    if not isinstance(value, str):
        raise wrong_type(name, what, value)
    if not (value or empty) or "\0" in value:
        raise wrong(name, f"{what}, neither empty nor with a NUL character" if not empty else f"{what} without a NUL character", value)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise wrong(name, f"{what} of characters that have a code in UTF-8", value) from None
    return str(value)


def token(name: str, value: Any) -> str:
    """A token for an HTTP header."""
    expected = "a token of visible ASCII characters"
    if not isinstance(value, str):
        raise InvalidType(f"{name}: expected {expected}, got an object of type {type(value).__name__}")
    if not value or not all("!" <= c <= "~" for c in value):
        raise InvalidRequest(f"{name}: expected {expected}, got others among its {len(value)}")
    return value


def choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """One of some words."""
    words = list(choices)
    expected = ", ".join(f'"{word}"' for word in words[:-1]) + f' or "{words[-1]}"'
    if not isinstance(value, str):
        raise wrong_type(name, expected, value)
    if value not in words:
        raise wrong(name, expected, value)
    return value


def path(name: str, value: Any, what: str = "a path") -> str:
    """A path of the file system."""
    if not isinstance(value, (str, os.PathLike)):
        raise wrong_type(name, what, value)
    found = os.fspath(value)
    if isinstance(found, bytes):
        raise wrong_type(name, f"{what} as text", value)
    return text(name, found, what)


def content(name: str, file: str | os.PathLike[str]) -> bytes:
    """The bytes of a file.

    Raises :class:`OSError` with the name of the argument.
    """
    try:
        with open(file, "rb") as opened:
            return opened.read()
    except OSError as error:
        raise type(error)(error.errno, f"{name}: {error.strerror}", os.fspath(file)) from None


def items(name: str, value: Any, what: str) -> list[Any]:
    """Items of an iterable: a list, a tuple, an array of one dimension. Text, mappings and sets are rejected."""
    if isinstance(value, (str, bytes, bytearray, memoryview)):
        example = f"; write [{shown(value)}]" if isinstance(value, str) else ""
        kind = "the text" if isinstance(value, str) else "the bytes"
        raise InvalidType(f"{name}: expected {what}, got {kind} {shown(value)}{example}")
    is_array = isinstance(value, np.ndarray) and value.ndim != 1
    if is_array or isinstance(value, (Mapping, set, frozenset, type)) or not isinstance(value, Iterable):
        raise wrong_type(name, what, value)
    found: list[Any] = []
    for item in value:
        if len(found) == MAX_ITEMS:
            raise wrong(name, f"{what} of at most {MAX_ITEMS} items", value)
        found.append(item)
    return found


def unmasked(name: str, value: Any) -> None:
    """Raises :class:`InvalidRequest` for an array with masked values: NumPy would take the numbers behind the mask."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise wrong(name, "numbers without masked values (.filled(number) or .compressed() gives them)", value)


def names(name: str, value: Any) -> list[str]:
    """A list of names."""
    return [text(f"{name}[{k}]", item, "a name as text") for k, item in enumerate(items(name, value, "a list of names"))]


def mapping(name: str, value: Any, what: str) -> Mapping[Any, Any]:
    """A mapping."""
    if not isinstance(value, Mapping):
        raise wrong_type(name, what, value)
    return value


def volts(name: str, value: Any) -> dict[str, float]:
    """Port values by name; None gives no values."""
    if value is None:
        return {}
    expected = 'names of ports with their volts, as {"drive": 3.0}'
    found = {}
    for port, volt in mapping(name, value, expected).items():
        found[text(f"{name}: name of a port", port, "a text")] = number(f"{name}[{port!r}]", volt)
    return found


def given_to(ports: Mapping[str, float], voltages: Any) -> Mapping[str, float]:
    """Checked values of some of these ports. A dictionary of finite ``float`` is returned unchanged."""
    if type(voltages) is dict and voltages.keys() <= ports.keys():
        if all(type(value) is float and math.isfinite(value) for value in voltages.values()):
            return voltages
    if voltages is None:
        raise wrong_type("voltages", 'names of ports with their volts, as {"drive": 3.0}', None)
    given = volts("voltages", voltages)
    unknown = [port for port in given if port not in ports]
    if unknown:
        raise InvalidRequest(f"voltages: no port named {unknown[0]!r}; the session has {', '.join(ports) or 'none'}")
    return given


def one_of(name: str, value: Any, known: Iterable[str], what: str) -> str:
    """One of some names."""
    found = text(name, value, "a name as text")
    if found not in known:
        raise InvalidRequest(f"{name}: {found!r} is not among the {what}: {', '.join(known) or 'none'}")
    return found


def setting(name: str, value: Any) -> float | str:
    """A value of a parameter: a number or a text."""
    if isinstance(value, str):
        return text(name, value, "a number or a text")
    return number(name, value, "a finite number or a text")


def settings(name: str, value: Any) -> dict[str, float | str]:
    """Values of parameters by name; None gives no values."""
    if value is None:
        return {}
    expected = 'names of parameters with their values, as {"w": 2e-6}'
    return {
        text(f"{name}: name of a parameter", key, "a text"): setting(f"{name}[{key!r}]", one)
        for key, one in mapping(name, value, expected).items()
    }


def function(name: str, value: C | None) -> C | None:
    """A function, or None."""
    if value is not None and not callable(value):
        raise wrong_type(name, "a function or None", value)
    return value


def instance(name: str, value: Any, kind: type[T] | tuple[type[Any], ...], what: str) -> T:
    """An object of a class."""
    if not isinstance(value, kind):
        raise wrong_type(name, what, value)
    found: T = value
    return found


def of_annotation(name: str, value: Any, annotation: Any) -> Any:
    """A value of a simple annotation: ``float``, ``int``, ``bool``, ``str``, ``Literal[…]``, or one of these or None."""
    kinds = [kind for kind in get_args(annotation) if kind is not type(None)] if type(None) in get_args(annotation) else [annotation]
    if value is None and len(kinds) != 1 or value is None and type(None) in get_args(annotation):
        return None
    kind = kinds[0]
    if get_origin(kind) is Literal:
        return choice(name, value, get_args(kind))
    if kind is bool:
        return flag(name, value)
    if kind is int:
        return integer(name, value)
    if kind is str:
        return text(name, value)
    return number(name, value)
