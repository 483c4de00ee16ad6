"""Specification of sweeps: analyses, axes of parameters, and distributions of random samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from .arguments import choice, integer, items, mapping, names, number, text, volts, wrong, wrong_type


def _set(owner: object, **fields: Any) -> None:
    """Sets fields of a frozen object to their checked values."""
    for name, value in fields.items():
        object.__setattr__(owner, name, value)


@dataclass(frozen=True)
class Static:
    """Static equilibrium at each point."""

    outputs: Sequence[str] = ()
    """Columns: ``NODE.x`` [m], ``NODE.y`` [m], ``NODE.rz`` [rad], ``PORT.i`` [A], ``PORT.q`` [C], ``BEAM.T`` [K], or sums of these."""
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages [V]."""

    def __post_init__(self) -> None:
        _set(self, outputs=tuple(names("outputs", self.outputs)), voltages=volts("voltages", self.voltages))


@dataclass(frozen=True)
class Modes:
    """Natural frequencies at each point: columns ``f1`` … [Hz]."""

    count: int = 6
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages of the operating point [V]."""

    def __post_init__(self) -> None:
        _set(self, count=integer("count", self.count, 1), voltages=volts("voltages", self.voltages))


@dataclass(frozen=True)
class PullIn:
    """Pull-in and release voltage at each point: columns ``pull_in`` and ``release`` [V]."""

    max_v: float = 200.0
    """Highest voltage of the search [V]."""
    port: str = ""
    """Port or netlist source; empty: the first."""

    def __post_init__(self) -> None:
        _set(self, max_v=number("max_v", self.max_v, "a voltage", above=0.0), port=text("port", self.port, "a name", empty=True))


@dataclass(frozen=True)
class Transient:
    """Motion from rest at each point, with a column for each signal at the end time."""

    stop: float
    """End time [s]."""
    signals: Sequence[str]
    """Signals: ``NODE.x`` [m], ``NODE.vx`` [m/s], ``BEAM.T`` [K], ``GAP.gap`` [m], ``PORT.i`` [A], …"""
    voltages: Mapping[str, float] = field(default_factory=dict)
    """Port voltages held during the run [V]."""

    def __post_init__(self) -> None:
        signals = names("signals", self.signals)
        if not signals:
            raise wrong("signals", "at least one signal", self.signals)
        stop = number("stop", self.stop, "a time in seconds", above=0.0)
        _set(self, stop=stop, signals=tuple(signals), voltages=volts("voltages", self.voltages))


Analysis = Static | Modes | PullIn | Transient


@dataclass(frozen=True)
class Normal:
    """Normal distribution of a parameter."""

    mean: float
    deviation: float
    """Standard deviation, from 0."""

    def __post_init__(self) -> None:
        _set(self, mean=number("mean", self.mean), deviation=number("deviation", self.deviation, least=0.0))


@dataclass(frozen=True)
class Uniform:
    """Uniform distribution of a parameter from ``low`` to ``high``."""

    low: float
    high: float

    def __post_init__(self) -> None:
        low, high = number("low", self.low), number("high", self.high)
        if low > high:
            raise wrong("high", f"at least low, {low:g}", high)
        _set(self, low=low, high=high)


@dataclass(frozen=True)
class LogNormal:
    """Log-normal distribution of a parameter."""

    median: float
    deviation: float
    """Standard deviation of the natural logarithm, from 0."""

    def __post_init__(self) -> None:
        _set(self, median=number("median", self.median, above=0.0), deviation=number("deviation", self.deviation, least=0.0))


@dataclass(frozen=True)
class Samples:
    """Random samples of parameters, drawn at every point of the grid.

    >>> Samples({"wh": Normal(2e-6, 5e-8), "pitch": Uniform(49e-6, 50e-6)}, count=1000, seed=7)
    """

    vary: Mapping[str, Normal | Uniform | LogNormal]
    count: int
    seed: int = 0
    """Equal seeds give equal samples."""
    design: Literal["lhs", "random", "sobol"] = "lhs"
    """Latin hypercube, independent points, or a scrambled Sobol sequence (at most 65 536 samples)."""
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """Correlation of two normal or log-normal parameters (of the logarithm for the latter), from -1 to 1."""

    def __post_init__(self) -> None:
        vary = dict(mapping("vary", self.vary, 'parameters with their distributions, as {"w": Normal(2e-6, 5e-8)}'))
        if not vary:
            raise wrong("vary", "at least one parameter", self.vary)
        for name, given in vary.items():
            text("vary: name of a parameter", name, "a text")
            if not isinstance(given, (Normal, Uniform, LogNormal)):
                raise wrong_type(f"vary[{name!r}]", "Normal, Uniform or LogNormal", given)
        correlations: dict[tuple[str, str], float] = {}
        for pair, value in mapping("correlations", self.correlations, "pairs of parameters with their correlations").items():
            if not (isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(one, str) for one in pair)):
                raise wrong_type("correlations", "pairs of names of parameters as keys", pair)
            found = number(f"correlations[{pair!r}]", value)
            if not -1.0 <= found <= 1.0:
                raise wrong(f"correlations[{pair!r}]", "a number from -1 to 1", value)
            correlations[pair] = found
        count, seed = integer("count", self.count, 1), integer("seed", self.seed, 0, (1 << 64) - 1)
        choice("design", self.design, ("random", "lhs", "sobol"))
        _set(self, vary=vary, count=count, seed=seed, correlations=correlations)


Value = float | str
"""Value of a parameter [SI]; flags of options are True and False."""
Axes = (
    Mapping[str, Sequence[Value]]
    | Mapping[tuple[str, ...], Sequence[Sequence[Value]]]
    | Mapping[str | tuple[str, ...], Sequence[Value] | Sequence[Sequence[Value]]]
)
"""Axes of a grid: values by the name of a parameter, or points of several parameters that vary together by a tuple of their names."""


def points(parameters: Axes) -> list[tuple[tuple[str, ...], list[tuple[Value, ...]]]]:
    """Checked axes: names that vary together, and their values at each point."""
    axes: list[tuple[tuple[str, ...], list[tuple[Value, ...]]]] = []
    for key, values in mapping("parameters", parameters, 'names with their values, as {"w": [1.8e-6, 2.2e-6]}').items():
        where = f"parameters[{key!r}]" if isinstance(key, (str, tuple)) else "parameters: name of a parameter"
        together: tuple[str, ...]
        rows: list[tuple[Any, ...]]
        if isinstance(key, str):
            together, rows = (text(where, key, "a name"),), [(point,) for point in items(where, values, "a list of values")]
        elif isinstance(key, tuple) and key:
            together = tuple(text(where, name, "names as text") for name in key)
            listed = items(where, values, f"a list of points, each with a value for each of {len(key)} names")
            rows = [tuple(items(f"{where}[{k}]", row, f"a value for each of {len(key)} names")) for k, row in enumerate(listed)]
        else:
            raise wrong_type(where, "a name, or a tuple of names that go together", key)
        if not rows:
            raise wrong(where, "at least one value", values)
        axes.append((together, [_point(where, k, together, row) for k, row in enumerate(rows)]))
    return axes


def _point(where: str, k: int, together: tuple[str, ...], row: tuple[Any, ...]) -> tuple[Value, ...]:
    if len(row) != len(together):
        raise wrong(f"{where}[{k}]", f"a value for each of {len(together)} names", row)
    return tuple(_value(f"{where}[{k}]", name, value) for name, value in zip(together, row))


def _value(where: str, name: str, value: Any) -> Value:
    """A number or text; for an option also a flag."""
    if name.startswith("option."):
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, str):
            return text(where, value, "a value of an option")
    elif isinstance(value, str):
        return text(where, value, "a number or a text")
    return number(where, value, "a finite number or a text")


def shard_of(shard: Any) -> tuple[int, int]:
    """Checked part (i, n) of a sweep."""
    expected = "(i, n), the part number i of n, with 0 <= i < n"
    if not isinstance(shard, (tuple, list)):
        raise wrong_type("shard", expected, shard)
    if len(shard) != 2:
        raise wrong("shard", expected, shard)
    i, n = (integer(f"shard[{k}]", part) for k, part in enumerate(shard))
    if not i < n:
        raise wrong("shard", expected, shard)
    return i, n
