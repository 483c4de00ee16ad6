"""Results as tables and plots; pandas and matplotlib are imported at first use."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .arguments import wrong_type

if TYPE_CHECKING:
    import pandas
    import pyarrow
    from matplotlib.axes import Axes

_SHOWN = 20
"""Most rows of a table in a notebook."""


def frame(columns: Mapping[str, Any], index: tuple[str, Any] | None = None, units: Mapping[str, str] | None = None) -> pandas.DataFrame:
    """A table of pandas; ``index`` is its name and values, ``units`` become ``attrs["units"]``."""
    try:
        import pandas
    except ImportError:
        raise ImportError("to_pandas() needs pandas: pip install pandas") from None
    found = pandas.DataFrame(dict(columns), index=None if index is None else pandas.Index(index[1], name=index[0]))
    if units:
        found.attrs["units"] = dict(units)
    return found


def frame_of_sessions(columns: Mapping[str, Any], count: int, t: Any, units: Mapping[str, str]) -> pandas.DataFrame:
    """A table of pandas by session, from 0, and time [s]."""
    found = frame({"session": np.repeat(np.arange(count), len(t)), "t": np.tile(t, count), **columns}, None, units)
    return found.set_index(["session", "t"])


def arrow(columns: Mapping[str, Sequence[Any]], units: Mapping[str, str], about: Mapping[str, str]) -> pyarrow.Table:
    """A table of Arrow with units in the metadata of its fields, and ``about`` in that of the table."""
    try:
        import pyarrow
    except ImportError:
        raise ImportError("to_arrow() needs pyarrow: pip install pyarrow") from None
    # empty columns have their type too, so that all parts of a sweep have one schema
    kinds = {name: pyarrow.float64() if name in units or all(x is None for x in values) else None for name, values in columns.items()}
    kinds |= {"point": pyarrow.int64(), "warning": pyarrow.string(), "error": pyarrow.string()}
    arrays = {name: pyarrow.array(_alike(values), type=kinds[name]) for name, values in columns.items()}
    unit = {name: {"unit": units[name]} if name in units else None for name in arrays}
    fields = [pyarrow.field(name, array.type, metadata=unit[name]) for name, array in arrays.items()]
    return pyarrow.table(list(arrays.values()), schema=pyarrow.schema(fields, metadata=dict(about)))


def _alike(values: Sequence[Any]) -> Sequence[Any]:
    """Numbers as text if other values are text, because a column of Arrow has one type."""
    if not any(isinstance(value, str) for value in values):
        return values
    return [value if value is None or isinstance(value, str) else repr(value) for value in values]


def axes(given: Axes | None) -> Axes:
    """The given axes, or those of a new figure."""
    if given is not None:
        if not (hasattr(given, "plot") and hasattr(given, "set_xlabel")):
            raise wrong_type("ax", "axes of matplotlib or None", given)
        return given
    try:
        from matplotlib import pyplot
    except ImportError:
        raise ImportError("plot() needs matplotlib: pip install matplotlib") from None
    return pyplot.subplots()[1]


def table(head: Sequence[str], rows: Iterable[Sequence[object]], note: str = "") -> str:
    """An HTML table of the first rows, with a note below it."""
    cells = [[f"<td>{html.escape(_short(value))}</td>" for value in row] for row in rows]
    shown = cells[:_SHOWN]
    if len(cells) > _SHOWN:
        note = " · ".join(filter(None, [f"{len(cells)} rows, the first {_SHOWN} of them", note]))
    titles = "".join(f"<th>{html.escape(title)}</th>" for title in head)
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in shown)
    return f"<table><tr>{titles}</tr>{body}</table>" + (f"<p>{html.escape(note)}</p>" if note else "")


def note(estimated_error: float | None, warnings: Iterable[str]) -> str:
    """Note below a table: estimated error and warnings."""
    error = "no error estimate" if estimated_error is None else f"estimated error {estimated_error:.1e}"
    return " · ".join(filter(None, [error, *warnings]))


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)
