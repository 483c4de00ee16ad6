"""Statistics of a sweep: moments, percentiles, the fraction of points within limits, and histograms.

A point without a result, or with NaN, is outside of every limit on that result. It is left out of moments, percentiles and histograms, and counted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .arguments import choice, integer, items, number, text, wrong
from .errors import InvalidRequest
from .showing import table as html

if TYPE_CHECKING:
    from .table import Table

_SUFFIXES = {
    **{"": 0, "a": -18, "f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "h": 2, "k": 3},
    **{"M": 6, "meg": 6, "G": 9, "T": 12, "P": 15, "E": 18},
}
"""Exponents by the suffixes of netlists (docs/reference/netlist.md, "Numbers"): ``m`` is milli, ``M`` mega; and ``meg`` of SPICE."""
_LIMIT = re.compile(r"\s*(?P<name>.+?)\s*(?P<relation><=|>=|<|>)\s*(?P<value>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,9})?)(?P<suffix>[a-zA-Z]*)\s*\Z")
_RELATIONS: dict[str, Callable[[Any, float], Any]] = {
    "<": lambda values, bound: values < bound,
    "<=": lambda values, bound: values <= bound,
    ">": lambda values, bound: values > bound,
    ">=": lambda values, bound: values >= bound,
}
_Z = 1.959963984540054
"""Quantile of the normal distribution for 95 % on both sides."""
MAX_BINS = 100_000
"""Most bins of a histogram."""
PERCENTILES = (5.0, 50.0, 95.0)


@dataclass(frozen=True)
class Limit:
    """A limit of a result, such as ``yoke.y > -1.1u``."""

    name: str
    """Name of a result or parameter."""
    relation: str
    """Relation of the result to the limit: ``<``, ``<=``, ``>`` or ``>=``."""
    value: float
    """Value of the limit, in the unit of the result."""

    def __post_init__(self) -> None:
        text("name", self.name, "the name of a result or a parameter")
        choice("relation", self.relation, _RELATIONS)
        object.__setattr__(self, "value", number("value", self.value))

    def __str__(self) -> str:
        return f"{self.name} {self.relation} {self.value:g}"


@dataclass(frozen=True)
class Fraction:
    """A fraction of the points of a sweep."""

    passed: int
    """Points within the limits."""
    points: int
    """All points."""

    @property
    def value(self) -> float:
        """``passed / points`` [1]; NaN without points."""
        return self.passed / self.points if self.points else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the fraction of independent random samples (Wilson, 1927) [1]."""
        n, p = self.points, self.value
        if not n:
            return 0.0, 1.0
        centre = (p + _Z * _Z / (2 * n)) / (1 + _Z * _Z / n)
        half = _Z / (1 + _Z * _Z / n) * math.sqrt(p * (1 - p) / n + _Z * _Z / (4 * n * n))
        return max(0.0, centre - half), min(1.0, centre + half)


@dataclass(frozen=True)
class ColumnStatistics:
    """Statistics of a result over the points that have it."""

    name: str
    """Name of the result."""
    unit: str
    """Its unit."""
    count: int
    """Points with a number."""
    missing: int
    """Points without a result, or with NaN; they are left out of the numbers below."""
    mean: float
    """Mean. Where no point has a number, this and the numbers below are NaN."""
    deviation: float
    """Standard deviation of a sample, with count - 1; NaN for a single point."""
    minimum: float
    """Smallest value."""
    maximum: float
    """Largest value."""
    percentiles: dict[float, float]
    """Values by percentage, interpolated linearly between ordered values (Hyndman and Fan, 1996, type 7)."""


@dataclass(frozen=True, repr=False)
class SweepStatistics:
    """Statistics of every result of a sweep, and the number of points within limits.

    Points without a result, or with NaN, are left out of the moments and percentiles of a column and counted in its ``missing``. They are outside of
    every limit on that result.
    """

    points: int
    """Points of the table."""
    columns: dict[str, ColumnStatistics]
    """Statistics by name of the result."""
    limits: tuple[tuple[Limit, Fraction], ...]
    """Each limit, with the fraction of points within it."""
    passed: Fraction
    """Fraction of points within all limits: the yield. Without limits, the fraction of points with a result."""
    undecided: int = 0
    """Points with a result that is closer to a limit than its estimated error: they count as ``passed`` or not by the computed value."""

    def __repr__(self) -> str:
        low, high = self.passed.interval
        missing = max((one.missing for one in self.columns.values()), default=0)
        parts = [f"{self.points} points", f"{missing} of them without a result" if missing else ""]
        parts += [f"yield {self.passed.value:.2%} ({low:.2%} to {high:.2%})", self._undecided()]
        return f"<SweepStatistics of {', '.join(self.columns) or 'nothing'}: {', '.join(filter(None, parts))}>"

    def _undecided(self) -> str:
        return f"{self.undecided} closer to a limit than their estimated error" if self.undecided else ""

    def _repr_html_(self) -> str:
        rows = [
            (f"{one.name} [{one.unit}]", one.count, one.missing, one.mean, one.deviation, one.minimum, *one.percentiles.values(), one.maximum)
            for one in self.columns.values()
        ]
        percentages = [f"{percentage:g} %" for percentage in next((list(one.percentiles) for one in self.columns.values()), [])]
        low, high = self.passed.interval
        kept = [f"{limit}: {fraction.value:.2%}" for limit, fraction in self.limits]
        interval = f"yield {self.passed.value:.2%}, 95 % interval of independent samples {low:.2%} to {high:.2%}"
        note = " · ".join(filter(None, [*kept, interval, self._undecided()]))
        return html(["result", "points", "without", "mean", "standard deviation", "minimum", *percentages, "maximum"], rows, note)


@dataclass(frozen=True, eq=False)
class Histogram:
    """Histogram of a result."""

    name: str
    """Name of the result."""
    unit: str
    """Unit of the result."""
    counts: NDArray[np.int64]
    """Points in each bin."""
    edges: NDArray[np.float64]
    """Edges of the bins (bins + 1). A value on an inner edge is in the bin above, the largest value in the last bin."""


def limit_of(given: Any, where: str = "limits") -> Limit:
    """A limit as text: ``NAME>NUMBER``, with the suffixes of netlists (``u``, ``m`` for milli, ``k``, ``M`` for mega, which SPICE reads as milli)."""
    if isinstance(given, Limit):
        return given
    expected = "a limit as NAME>NUMBER, with <, <=, > or >= and a suffix of netlists (m is milli, M is mega), such as \"yoke.y>-1.1u\","
    found = _LIMIT.match(text(where, given, expected))
    suffix = found["suffix"] if found else ""
    exponent = _SUFFIXES.get("meg" if suffix.lower() == "meg" else suffix)
    if found is None or exponent is None:
        raise wrong(where, expected, given)
    # rounded once, as in netlists
    mantissa, _, power = found["value"].lower().partition("e")
    bound = float(f"{mantissa}e{int(power or 0) + exponent}")
    if not math.isfinite(bound):
        raise wrong(where, f"{expected} of at most 1.8e308", given)
    return Limit(found["name"], found["relation"], bound)


def statistics_of(table: Table, limits: str | Limit | Iterable[str | Limit] = (), percentiles: Sequence[float] = PERCENTILES) -> SweepStatistics:
    """Statistics of a table."""
    listed = [limits] if isinstance(limits, (str, Limit)) else items("limits", limits, "a list of limits")
    wanted = [limit_of(one, f"limits[{k}]") for k, one in enumerate(listed)]
    shares = [_percentage(f"percentiles[{k}]", one) for k, one in enumerate(items("percentiles", percentiles, "a list of percentages"))]
    columns = {name: _column(table, name, shares) for name in table.results}
    passes = np.ones(len(table.rows), dtype=bool)
    is_close = np.zeros(len(table.rows), dtype=bool)
    errors = np.array([math.nan if row.estimated_error is None else row.estimated_error for row in table.rows], dtype=np.float64)
    fractions = []
    for limit in wanted:
        if limit.name not in table.results and limit.name not in table.parameters:
            known = ", ".join([*table.parameters, *table.results])
            raise InvalidRequest(f"limits: expected the name of a column, got {limit.name!r}; there are {known}")
        values = values_of(table, limit.name, "limits")
        keeps = _RELATIONS[limit.relation](values, limit.value)
        if limit.name in table.results:
            is_close |= np.abs(values - limit.value) <= errors * np.abs(values)
        fractions.append((limit, Fraction(int(keeps.sum()), len(table.rows))))
        passes &= keeps
    if not wanted:
        passes = np.array([not row.error for row in table.rows], dtype=bool)
    return SweepStatistics(len(table.rows), columns, tuple(fractions), Fraction(int(passes.sum()), len(table.rows)), int(is_close.sum()))


def histogram_of(table: Table, name: str, bins: int | str = "auto") -> Histogram:
    """A histogram of a result. Its points are those with a finite value."""
    if isinstance(bins, str):
        if bins != "auto":
            raise wrong("bins", '"auto" or a number of bins', bins)
    else:
        bins = integer("bins", bins, 1, MAX_BINS)
    values = values_of(table, name)
    counts, edges = np.histogram(values[np.isfinite(values)], *_bins(name, values[np.isfinite(values)], bins))
    return Histogram(name, table.units.get(name, ""), counts.astype(np.int64), edges)


def _bins(name: str, values: NDArray[np.float64], bins: int | str) -> tuple[int, tuple[float, float]]:
    """Number of bins, and their range. Bins are wider than the distance of two neighbouring numbers."""
    if not values.size:
        return (1 if isinstance(bins, str) else bins), (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if not math.isfinite(high - low):
        raise InvalidRequest(f"name: expected a column with a finite range, got {name!r} from {low:g} to {high:g}")
    if low == high:
        half = 0.5 * abs(low) or 0.5
        return (1 if isinstance(bins, str) else bins), (low - half, high + half)
    most = max(int((high - low) / (2.0 * float(np.spacing(max(abs(low), abs(high)))))), 1)
    if isinstance(bins, str):
        with np.errstate(all="ignore"):
            width = float(np.subtract(*np.percentile(values, [75, 25]))) * 2.0 / values.size ** (1 / 3)
        wanted = math.log2(values.size) + 1.0
        wanted = max(wanted, (high - low) / width) if width > 0.0 else wanted
        return max(min(math.ceil(min(wanted, MAX_BINS)), most), 1), (low, high)
    if bins > most:
        raise wrong("bins", f"at most {most} bins, as the values of {name!r} differ by {high - low:.3g} only", bins)
    return bins, (low, high)


def values_of(table: Table, name: str, argument: str = "name") -> NDArray[np.float64]:
    """The numbers of a column; NaN where a point has none."""
    found = table.column(name)
    if any(isinstance(value, str) for value in found):
        raise InvalidRequest(f"{argument}: expected a column of numbers, got {name!r}, which has texts")
    return np.array([math.nan if value is None else value for value in found], dtype=np.float64)


def _percentage(where: str, given: Any) -> float:
    return number(where, given, "a percentage", least=0.0, most=100.0)


def _column(table: Table, name: str, percentages: Sequence[float]) -> ColumnStatistics:
    values = np.array([row.results[name] for row in table.rows if name in row.results], dtype=np.float64)
    values = values[~np.isnan(values)]
    n = len(values)
    return ColumnStatistics(
        name,
        table.units[name],
        n,
        len(table.rows) - n,
        float(values.mean()) if n else math.nan,
        float(values.std(ddof=1)) if n > 1 else math.nan,
        float(values.min()) if n else math.nan,
        float(values.max()) if n else math.nan,
        {one: float(np.percentile(values, one)) if n else math.nan for one in percentages},
    )
