"""Sweeps: what to compute on a grid of parameters, and the table that comes back."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from . import showing
from .v1 import analysis_pb2, model_pb2, sweep_pb2

if TYPE_CHECKING:
    import pandas
    import pyarrow


@dataclass(frozen=True)
class Static:
    """Static equilibrium at each point."""

    outputs: Sequence[str] = ()
    """Columns: ``NODE.x`` [m], ``NODE.y`` [m], ``NODE.rz`` [rad], ``PORT.i`` [A], ``PORT.q`` [C], ``BEAM.T`` [K]."""
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages [V]."""


@dataclass(frozen=True)
class Modes:
    """Natural frequencies at each point: columns ``f1`` … [Hz]."""

    count: int = 6
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages of the operating point [V]."""


@dataclass(frozen=True)
class PullIn:
    """Pull-in and release voltage at each point: columns ``pull_in`` and ``release`` [V]."""

    max_v: float = 200.0
    """Highest voltage tried [V]."""
    port: str = ""
    """Port or netlist source; empty: the first."""


@dataclass(frozen=True)
class Transient:
    """Motion from rest at each point: signals at its end, in columns of their names."""

    stop: float
    """End time [s]."""
    signals: Sequence[str]
    """Signals wanted: ``NODE.x`` [m], ``NODE.vx`` [m/s], ``BEAM.T`` [K], ``GAP.gap`` [m], …"""
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages held during the run [V]."""


Analysis = Static | Modes | PullIn | Transient


@dataclass(frozen=True)
class Normal:
    """Gauss' distribution of a parameter."""

    mean: float
    deviation: float
    """Standard deviation, from 0."""


@dataclass(frozen=True)
class Uniform:
    """Every value from ``low`` to ``high`` alike."""

    low: float
    high: float


@dataclass(frozen=True)
class LogNormal:
    """A parameter whose logarithm is normal."""

    median: float
    deviation: float
    """Standard deviation of the natural logarithm, from 0."""


@dataclass(frozen=True)
class Samples:
    """Samples of parameters that vary by chance, drawn at every point of the grid.

    >>> Samples({"wh": Normal(2e-6, 5e-8), "pitch": Uniform(49e-6, 50e-6)}, count=1000, seed=7)
    """

    vary: Mapping[str, Normal | Uniform | LogNormal]
    count: int
    seed: int = 0
    """The same seed draws the same samples."""
    design: Literal["lhs", "random", "sobol"] = "lhs"
    """Latin hypercube, independent points, or a scrambled Sobol sequence (at most 65 536 samples)."""
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """Of two normal or log-normal parameters (of the logarithm there), between -1 and 1."""


def _samples(samples: Samples) -> Any:
    vary = []
    for name, given in samples.vary.items():
        if isinstance(given, Normal):
            one = sweep_pb2.SweepVary(name=name, normal=sweep_pb2.SweepNormal(mean=given.mean, deviation=given.deviation))
        elif isinstance(given, Uniform):
            one = sweep_pb2.SweepVary(name=name, uniform=sweep_pb2.SweepUniform(low=given.low, high=given.high))
        elif isinstance(given, LogNormal):
            wire = sweep_pb2.SweepLogNormal(median=given.median, deviation=given.deviation)
            one = sweep_pb2.SweepVary(name=name, log_normal=wire)
        else:
            raise TypeError(f"{name}: expected Normal, Uniform or LogNormal, got {given!r}")
        vary.append(one)
    designs = {
        "random": sweep_pb2.SweepSamples.DESIGN_RANDOM,
        "lhs": sweep_pb2.SweepSamples.DESIGN_LATIN_HYPERCUBE,
        "sobol": sweep_pb2.SweepSamples.DESIGN_SOBOL,
    }
    if samples.design not in designs:
        raise ValueError(f"design: expected one of {', '.join(designs)}, got {samples.design!r}")
    correlations = [sweep_pb2.SweepCorrelation(a=a, b=b, value=value) for (a, b), value in samples.correlations.items()]
    return sweep_pb2.SweepSamples(
        vary=vary,
        count=samples.count,
        seed=samples.seed,
        design=designs[samples.design],
        correlations=correlations,
    )


@dataclass(frozen=True)
class Row:
    """One point of the grid."""

    point: int
    """Number in the full grid, from 0; the last parameter varies fastest."""
    parameters: dict[str, float | str]
    """Value of each parameter [SI]."""
    results: dict[str, float]
    """Results that exist at this point; empty when ``error`` is set."""
    error: str
    """Why the point has no result; empty when it has."""
    estimated_error: float | None = None
    """Largest estimated relative error of the results by the mesh; None without an estimate."""
    warning: str = ""
    """Why the results may be further off than the tolerance; empty when they are not."""


@dataclass(frozen=True, repr=False)
class Table:
    """Everything a sweep found, in grid order."""

    parameters: list[str]
    results: list[str]
    units: dict[str, str]
    """Unit of each result column."""
    rows: list[Row]

    def column(self, name: str) -> list[float | str | None]:
        """One column; None where a point has no such value. A result may be named with its unit, ``f1 [Hz]``, as it must be where a
        parameter has its name. Raises :class:`KeyError` for a name that is no column, or two."""
        headings = {self._heading(result): result for result in self.results}
        if name in headings:
            return [row.results.get(headings[name]) for row in self.rows]
        if name in self.parameters and name in self.results:
            raise KeyError(f"{name!r} is a parameter and a result: the result is {self._heading(name)!r}, the parameter is in `rows`")
        if name in self.parameters:
            return [row.parameters[name] for row in self.rows]
        if name not in self.results:
            raise KeyError(f"no column {name!r}; there are {', '.join([*self.parameters, *self.results])}")
        return [row.results.get(name) for row in self.rows]

    def _heading(self, result: str) -> str:
        return f"{result} [{self.units[result]}]"

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each parameter and each result (NaN where a point has none), by number of the point; with ``estimated_error``,
        ``warning`` and ``error``. A result that has the name of a parameter is called with its unit, ``f1 [Hz]``.

        Raises :class:`ValueError` for a parameter with one of the three names."""
        return showing.frame(self._columns(math.nan), ("point", [row.point for row in self.rows]))

    def to_arrow(self) -> pyarrow.Table:
        """The columns of :meth:`to_pandas` behind the number of the point, null where a point has no such number; the unit of a result stands
        in the metadata of its field, the number of columns that are parameters in that of the table. For Parquet:
        ``pyarrow.parquet.write_table(table.to_arrow(), "mc.parquet")``.

        Raises :class:`ValueError` for a parameter with one of the names of the last columns."""
        units = {(self._heading(name) if name in self.parameters else name): self.units[name] for name in self.results}
        columns = {"point": [row.point for row in self.rows], **self._columns(None)}
        return showing.arrow(columns, {**units, "estimated_error": "1"}, {"parameters": str(len(self.parameters))})

    def _columns(self, none: float | None) -> dict[str, list[Any]]:
        """Every column but the number of the point; ``none`` where a point has no such number."""
        last = ("estimated_error", "warning", "error")
        taken = [name for name in self.parameters if name in ("point", *last)]
        if taken:
            raise ValueError(f"parameter {taken[0]!r} has the name of another column: rename it, or read `rows`")
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
        """CSV with the columns of ``bimorph sweep``: point, parameters, results with units, estimate, warning, error."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["point", *self.parameters, *map(self._heading, self.results), "estimated_error [1]", "warning", "error"])
        for row in self.rows:
            values = [row.results.get(name, "") for name in self.results]
            estimate = "" if row.estimated_error is None else row.estimated_error
            writer.writerow([row.point, *row.parameters.values(), *values, estimate, row.warning, row.error])
        return out.getvalue()


def setting(name: str, value: float | str) -> Any:
    """A named value as it travels."""
    if isinstance(value, str):
        return model_pb2.Setting(name=name, text=value)
    return model_pb2.Setting(name=name, number=float(value))


Value = float | str
"""A value of a parameter [SI]; flags of options are True and False."""
Axes = (
    Mapping[str, Sequence[Value]]
    | Mapping[tuple[str, ...], Sequence[Sequence[Value]]]
    | Mapping[str | tuple[str, ...], Sequence[Value] | Sequence[Sequence[Value]]]
)
"""Axes of a grid: the values of a parameter by its name, or the points of several that go together by their names in a tuple."""


def _axes(parameters: Axes) -> list[Any]:
    """The axes as they travel."""
    axes = []
    for key, values in parameters.items():
        names = (key,) if isinstance(key, str) else tuple(key)
        points: Sequence[Any] = values
        rows: list[tuple[Value, ...]] = [(point,) if isinstance(key, str) else tuple(point) for point in points]
        wrong = next((row for row in rows if len(row) != len(names)), None)
        if not names or wrong is not None:
            raise ValueError(f"{key!r}: expected a value for each of {len(names)} names at every point, got {wrong!r}")
        for k, name in enumerate(names):
            word = name.startswith("option.")
            listed = [str(row[k]).lower() if word and isinstance(row[k], bool) else row[k] for row in rows]
            settings = sweep_pb2.SettingList(values=[setting("", value) for value in listed])
            axes.append(sweep_pb2.SweepParameter(name=name, **{"in_step" if k else "list": settings}))
    return axes


def to_wire(
    parameters: Axes,
    analysis: Analysis,
    shard: tuple[int, int],
    samples: Samples | None = None,
) -> Any:
    """A specification as it travels."""
    spec = sweep_pb2.SweepSpec(parameters=_axes(parameters), shard=shard[0], shards=shard[1])
    if samples is not None:
        spec.samples.CopyFrom(_samples(samples))
    if isinstance(analysis, PullIn):
        spec.pull_in.CopyFrom(sweep_pb2.SweepPullIn(port=analysis.port, max_v=analysis.max_v))
        return spec
    voltages = [analysis_pb2.Named(name=name, value=value) for name, value in analysis.voltages.items()]
    if isinstance(analysis, Static):
        spec.static.CopyFrom(sweep_pb2.SweepStatic(outputs=analysis.outputs, voltages=voltages))
    elif isinstance(analysis, Transient):
        wire = sweep_pb2.SweepTransient(stop_s=analysis.stop, outputs=analysis.signals, voltages=voltages)
        spec.transient.CopyFrom(wire)
    else:
        spec.modes.CopyFrom(sweep_pb2.SweepModes(count=analysis.count, voltages=voltages))
    return spec
