"""A table of arguments of the wrong kind, range or shape, and which of them each parameter accepts."""

from __future__ import annotations

import datetime
import decimal
import fractions
import math
import numbers
import pathlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


class Anything:
    """Made of anything."""

    def __init__(self, *arguments: object) -> None:
        pass


VALUES: dict[str, Any] = {
    "None": None,
    "True": True,
    "text": "nosuch",
    "number as text": "1",
    "empty text": "",
    "text with NUL": "a\0b",
    "text without a code": "\ud800",
    "bytes": b"nosuch",
    "bytearray": bytearray(b"nosuch"),
    "NaN": math.nan,
    "infinite": math.inf,
    "minus infinite": -math.inf,
    "-1": -1,
    "-1.5": -1.5,
    "0": 0,
    "0.0": 0.0,
    "1e300": 1e300,
    "10**400": 10**400,
    "complex": 1j,
    "decimal": decimal.Decimal("NaN"),
    "fraction": fractions.Fraction(-1, 3),
    "NaN of float32": np.float32("nan"),
    "empty list": [],
    "list of numbers": [1.0, math.nan],
    "list of a text": ["nosuch"],
    "list of None": [None],
    "nested list": [[1.0]],
    "empty tuple": (),
    "tuple of three": (1, 2, 3),
    "empty dictionary": {},
    "dictionary of NaN": {"nosuch": math.nan},
    "dictionary of None": {"nosuch": None},
    "dictionary of a number key": {1: 1.0},
    "set": {1.0},
    "array": np.array([1.0, 2.0]),
    "array of no dimension": np.array(math.nan),
    "array of two dimensions": np.zeros((2, 2)),
    "array of texts": np.array(["nosuch"]),
    "ragged list": [[1.0], [1.0, 2.0]],
    "masked array": np.ma.array([1.0, 2.0], mask=[False, True]),
    "masked number": np.ma.masked,
    "commas": ",,",
    "list of commas": [",,"],
    "limit beyond numbers": "f1<1e400",
    "limit without end": "f1<1e" + "9" * 5000,
    "list of a limit beyond numbers": ["f1<1e400"],
    "dictionary of a ragged list": {"drive": [[1.0], [1.0, 2.0]]},
    "dictionary of a masked array": {"drive": np.ma.array([1.0], mask=[True])},
    "dictionary of a list": {"drive": [1.0, 2.0, 3.0]},
    "object": object(),
    "class": Anything,
    "function": lambda *arguments: None,
    "date": datetime.date(2020, 1, 1),
    "path": pathlib.Path("/nosuch/file"),
    "iterator": 7,  # made anew for each call
}
"""Bad values by name: of wrong kind, range or shape, NaN, infinite, negative, zero, empty, huge, text, bytes, nested."""


def fresh(name: str) -> Any:
    """A value of the table."""
    return iter([1, 2]) if name == "iterator" else VALUES[name]


Accepts = Callable[[Any], bool]


def nothing(value: Any) -> bool:
    """Whether it is left out."""
    return value is None


def number(low: float = -math.inf, high: float = math.inf, *, open_low: bool = False) -> Accepts:
    """Finite real numbers from ``low`` to ``high``."""

    def accepts(value: Any) -> bool:
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
            return False
        try:
            found = float(value)
        except OverflowError:
            return False
        return math.isfinite(found) and low <= found <= high and not (open_low and found == low)

    return accepts


def integer(low: int, high: int = 2**31 - 1) -> Accepts:
    """Integers from ``low`` to ``high``."""
    return lambda value: isinstance(value, numbers.Integral) and not isinstance(value, bool) and low <= value <= high


def seconds(value: Any) -> bool:
    """Times above 0; infinite: no bound."""
    return number(0.0, open_low=True)(value) or isinstance(value, float) and value == math.inf


def flag(value: Any) -> bool:
    """True and False."""
    return isinstance(value, bool)


def text(value: Any) -> bool:
    """Texts that can be sent, of at least one character."""
    return isinstance(value, str) and value not in ("", "a\0b", "\ud800")


def text_or_empty(value: Any) -> bool:
    """The same, or none."""
    return text(value) or isinstance(value, str) and value == ""


def function(value: Any) -> bool:
    """What can be called."""
    return callable(value)


def empty_list(value: Any) -> bool:
    """No names."""
    return isinstance(value, (list, tuple)) and not value


def empty_mapping(value: Any) -> bool:
    """No names and values."""
    return isinstance(value, Mapping) and not value


def either(*kinds: Accepts) -> Accepts:
    """What one of them accepts."""
    return lambda value: any(kind(value) for kind in kinds)


def never(value: Any) -> bool:
    """None of the values of the table."""
    return False
