"""The table of a sweep."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from . import labelled, plots, showing
from .arguments import text
from .errors import InvalidRequest, NoResult, UnknownColumn
from .files import to_parquet
from .sweep_statistics import PERCENTILES, Histogram, Limit, SweepStatistics, histogram_of, statistics_of

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Row:
    """One point of the grid."""

    point: int
    """Number in the full grid, from 0; the last parameter varies fastest."""
    parameters: dict[str, float | str]
    """Value of each parameter [SI]."""
    results: dict[str, float]
    """Results of this point; empty if ``error`` is set."""
    error: str
    """Reason why the point has no result; empty if it has one."""
    estimated_error: float | None = None
    """Largest estimated relative error of the results by the mesh; None without an estimate."""
    warning: str = ""
    """Reason why the results may deviate by more than the tolerance; empty if they do not."""


@dataclass(frozen=True, repr=False)
class Table:
    """Table of a sweep, in grid order."""

    parameters: list[str]
    results: list[str]
    units: dict[str, str]
    """Unit of each result column."""
    rows: list[Row]

    def column(self, name: str) -> list[float | str | None]:
        """One column, with None for points without a value. A result can be named with its unit, ``f1 [Hz]``, and must be if a parameter has the
        same name.

        Raises :class:`InvalidRequest`, which is a :class:`KeyError` too, for an unknown or ambiguous name.
        """
        text("name", name, "the name of a column")
        headings = {self._heading(result): result for result in self.results}
        if name in headings:
            return [row.results.get(headings[name]) for row in self.rows]
        if name in self.parameters and name in self.results:
            raise UnknownColumn(f"name: expected the name of one column, got {name!r} of a parameter and a result; the result is {self._heading(name)!r}, the parameter is in `rows`")
        if name in self.parameters:
            return [row.parameters[name] for row in self.rows]
        if name not in self.results:
            raise UnknownColumn(f"name: expected the name of a column, got {name!r}; there are {', '.join([*self.parameters, *self.results])}")
        return [row.results.get(name) for row in self.rows]

    def _heading(self, result: str) -> str:
        return f"{result} [{self.units[result]}]"

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each parameter and result (NaN for points without one), and ``estimated_error``, ``warning`` and ``error``, by number of the
        point. A result with the name of a parameter has its unit in its name, ``f1 [Hz]``.

        ``attrs["units"]`` has the units of results.

        Raises :class:`InvalidRequest` for a parameter with the name of another column."""
        return showing.frame(self._columns(math.nan), ("point", [row.point for row in self.rows]), self._units())

    def to_xarray(self) -> xarray.Dataset:
        """Every result over a full grid, with an axis for each parameter. If the points are not a full grid, as for samples, by number of the
        point. Each array has its unit in ``attrs["units"]``, and NaN for points without a result."""
        return labelled.of_table(self)

    def statistics(
        self, limits: str | Limit | Iterable[str | Limit] = (), percentiles: Sequence[float] = PERCENTILES
    ) -> SweepStatistics:
        """Mean, standard deviation and percentiles of every result, and the yield: the fraction of points within all ``limits``, such as
        ``"yoke.y>-1.1u"``. Suffixes are those of netlists: ``m`` is milli, ``M`` is mega. A point without a result, or with NaN, is left out of the
        moments and counts as outside of the limits."""
        return statistics_of(self, limits, percentiles)

    def histogram(self, name: str, bins: int | Literal["auto"] = "auto") -> Histogram:
        """Histogram of a result with bins of equal width."""
        return histogram_of(self, name, bins)

    def plot(self, name: str | None = None, ax: Axes | None = None) -> Axes:
        """Draws a result, by default the first, over the last parameter, with a line for each value of the others. For random samples it draws
        the histogram."""
        return plots.sweep(self, name, ax)

    def _units(self) -> dict[str, str]:
        units = {(self._heading(name) if name in self.parameters else name): self.units[name] for name in self.results}
        return {**units, "estimated_error": "1"}

    def to_arrow(self) -> pyarrow.Table:
        """The number of the point and the columns of :meth:`to_pandas`, with null for missing numbers. The metadata of a field has the unit of its
        result, and that of the table the number of parameters.

        Raises :class:`InvalidRequest` for a parameter with the name of another column."""
        columns = {"point": [row.point for row in self.rows], **self._columns(None)}
        return showing.arrow(columns, self._units(), {"parameters": str(len(self.parameters))})

    def to_parquet(self, path: str | os.PathLike[str], *, filesystem: Any = None) -> None:
        """Writes :meth:`to_arrow` as a Parquet file. ``path`` is a local path or the URI of an object store of pyarrow (``s3://``, ``gs://``,
        ``abfs://``, ``hdfs://``), or a path in ``filesystem``, a file system of ``pyarrow.fs`` or fsspec."""
        to_parquet(self.to_arrow(), path, filesystem)

    def _columns(self, none: float | None) -> dict[str, list[Any]]:
        """Every column except the number of the point, with ``none`` for missing numbers."""
        last = ("estimated_error", "warning", "error")
        taken = [name for name in self.parameters if name in ("point", *last)]
        if taken:
            raise InvalidRequest(f"parameters: expected none with the name of another column, got {taken[0]!r}; rename it, or read `rows`")
        columns: dict[str, list[Any]] = {name: [row.parameters[name] for row in self.rows] for name in self.parameters}
        for name in self.results:
            called = self._heading(name) if name in self.parameters else name
            columns[called] = [row.results.get(name, none) for row in self.rows]
        return columns | {name: [getattr(row, name) for row in self.rows] for name in last}

    def __repr__(self) -> str:
        failed = sum(1 for row in self.rows if row.error)
        points = f"{len(self.rows)} points" + (f", {failed} of them failed" if failed else "")
        return f"<Table of {', '.join(self.results)} over {', '.join(self.parameters) or 'nothing'}: {points}>"

    def _repr_html_(self) -> str:
        head = ["point", *self.parameters, *map(self._heading, self.results), ""]
        rows = (
            [row.point, *row.parameters.values(), *(row.results.get(name) for name in self.results), row.error or row.warning]
            for row in self.rows
        )
        return showing.table(head, rows)

    def to_csv(self) -> str:
        """CSV text with the columns of ``bimorph sweep``: point, parameters, results with units, estimate, warning, error."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["point", *self.parameters, *map(self._heading, self.results), "estimated_error [1]", "warning", "error"])
        for row in self.rows:
            values = [row.results.get(name, "") for name in self.results]
            estimate = "" if row.estimated_error is None else row.estimated_error
            writer.writerow([row.point, *row.parameters.values(), *values, estimate, row.warning, row.error])
        return out.getvalue()


def with_results(table: Table) -> Table:
    """The table itself.

    Raises :class:`NoResult` if it has points but no result; ``error.table`` has the reason of each point.
    """
    if not table.rows or any(not row.error for row in table.rows):
        return table
    first = table.rows[0]
    raise NoResult(f"none of the {len(table.rows)} points of the sweep has a result; point {first.point}: {first.error}", table)
