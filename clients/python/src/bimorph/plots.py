"""Plots of results by matplotlib, which is imported at first use."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .arguments import text
from .errors import InvalidRequest
from .showing import axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .batch import BatchRun
    from .exports import ExportResult
    from .paths import PathResult
    from .results import FrequencyResponse, ModesResult, PullInResult, StaticResult
    from .table import Table

Array = NDArray[np.float64]

_LONGEST = 40
"""Most names on an axis."""


def static(result: StaticResult, ax: Axes | None) -> Axes:
    """Displacement of every node."""
    ax = axes(ax)
    places = np.arange(len(result.nodes))
    for axis, marker in (("x", "o"), ("y", "s")):
        ax.plot(places, [getattr(node, axis) for node in result.nodes.values()], marker, label=f"{axis} [m]")
    if len(places) <= _LONGEST:
        ax.set_xticks(places, list(result.nodes), rotation=90)
    ax.set_xlabel("node")
    ax.legend()
    return ax


def modes(result: ModesResult, ax: Axes | None) -> Axes:
    """Frequency of every mode, with its estimated error."""
    ax = axes(ax)
    numbers = np.arange(1, len(result.frequencies_hz) + 1)
    frequencies = np.array(result.frequencies_hz)
    errors = np.array([math.nan if error is None else abs(error) for error in result.errors], dtype=float)
    if len(errors) == len(frequencies) and np.isfinite(errors).any():
        ax.errorbar(numbers, frequencies, yerr=np.nan_to_num(errors) * frequencies, fmt="o", capsize=3)
    else:
        ax.plot(numbers, frequencies, "o")
    ax.set_xticks(numbers)
    ax.set_xlabel("mode")
    ax.set_ylabel("f [Hz]")
    return ax


def pull_in(result: PullInResult, ax: Axes | None) -> Axes:
    """State of the gap over the voltage, with pull-in on the way up and release on the way down."""
    ax = axes(ax)
    top = 1.2 * result.pull_in_v
    ax.plot([0.0, result.pull_in_v, result.pull_in_v, top], [0, 0, 1, 1], label="up")
    back = 0.0 if result.release_v is None else result.release_v
    down = ([top, 0.0], [1, 1]) if result.release_v is None else ([top, back, back, 0.0], [1, 1, 0, 0])
    ax.plot(*down, "--", label="down" if result.release_v is not None else "down: it stays closed")
    ax.set_yticks([0, 1], ["open", "closed"])
    ax.set_xlabel(f"{result.port} [V]")
    ax.legend()
    return ax


def response(result: FrequencyResponse, ax: Axes | None) -> Axes:
    """Magnitude of every signal over frequency, both on logarithmic scales."""
    ax = axes(ax)
    for name, values in result.magnitude.items():
        ax.loglog(result.frequencies_hz, values, label=f"{name} [{result.units[name]}]")
    ax.set_xlabel("f [Hz]")
    ax.legend()
    return ax


def path(result: PathResult, ax: Axes | None) -> Axes:
    """Every signal over the parameter of a path: solid where stable, dashed where unstable, with its limit points and bifurcations."""
    ax = axes(ax)
    # a segment is stable if both of its ends are
    solid = result.stable[:-1] & result.stable[1:]
    for k, (name, values) in enumerate(result.signals.items()):
        label: str | None = f"{name} [{result.units[name]}]"
        for shown, line in ((solid, "-"), (~solid, "--")):
            bounds = np.flatnonzero(np.diff(np.concatenate([[False], shown, [False]])))
            for first, last in bounds.reshape(-1, 2):
                run = slice(first, last + 1)
                ax.plot(result.values[run], values[run], line, color=f"C{k % 10}", label=label)
                label = None
        for points, marker in ((result.limit_points, "o"), (result.bifurcations, "s")):
            at = [one.point for one in points]
            ax.plot(result.values[at], values[at], marker, color=f"C{k % 10}")
    ax.set_xlabel(f"{result.along} [{result.unit}]" if result.unit else result.along)
    if result.signals:
        ax.legend()
    return ax


def export(result: ExportResult, ax: Axes | None) -> Axes:
    """Quality factor of every mode over its frequency; a vertical line for each undamped mode."""
    ax = axes(ax)
    damped = np.isfinite(result.quality)
    ax.loglog(result.frequencies_hz[damped], result.quality[damped], "o")
    for frequency in result.frequencies_hz[~damped]:
        ax.axvline(frequency, linestyle="--")
    ax.set_xlabel("f [Hz]")
    ax.set_ylabel("Q")
    return ax


def over_time(t: Array, signals: Mapping[str, Array], units: Mapping[str, str], ax: Axes | None) -> Axes:
    """Every signal over time, in its unit."""
    ax = axes(ax)
    for name, values in signals.items():
        ax.plot(t, values, label=f"{name} [{units[name]}]")
    ax.set_xlabel("t [s]")
    if signals:
        ax.legend()
    return ax


def batch(result: BatchRun, ax: Axes | None) -> Axes:
    """Every signal of every session over time: a colour for each signal, and a line for each session."""
    ax = axes(ax)
    for k, (name, values) in enumerate(result.signals.items()):
        lines = ax.plot(result.t, values.T, color=f"C{k % 10}", linewidth=0.8)
        if lines:
            lines[0].set_label(f"{name} [{result.units[name]}]")
    ax.set_xlabel("t [s]")
    if result.signals:
        ax.legend()
    return ax


def sweep(table: Table, name: str | None, ax: Axes | None) -> Axes:
    """A result over the last numeric parameter, with a line for each value of the others. Without a parameter, and for random samples, the histogram."""
    name = _result(table, name)
    ax = axes(ax)
    label = f"{name} [{table.units[name]}]"
    numbers = [one for one in table.parameters if not any(isinstance(row.parameters[one], str) for row in table.rows)]
    lines: dict[tuple[Any, ...], list[tuple[float, float]]] = {}
    for row in table.rows:
        if numbers:
            others = tuple(value for one, value in row.parameters.items() if one != numbers[-1])
            lines.setdefault(others, []).append((float(row.parameters[numbers[-1]]), row.results.get(name, math.nan)))
    if not numbers or len(table.rows) > 3 and len(lines) == len(table.rows) or _is_random(table, numbers[-1]):
        found = table.histogram(name)
        ax.stairs(found.counts, found.edges, fill=True)
        ax.set_xlabel(label)
        ax.set_ylabel("points")
        return ax
    rest = [one for one in table.parameters if one != numbers[-1]]
    for others, points in lines.items():
        points.sort()
        label_of_line = ", ".join(f"{one} = {value if isinstance(value, str) else format(value, 'g')}" for one, value in zip(rest, others))
        ax.plot(*zip(*points), "o-", markersize=3, label=label_of_line or None)
    ax.set_xlabel(numbers[-1])
    ax.set_ylabel(label)
    if 1 < len(lines) <= 12:
        ax.legend()
    return ax


def _result(table: Table, name: str | None) -> str:
    if name is None:
        if not table.results:
            raise InvalidRequest("name: expected a table with results, got one without")
        return table.results[0]
    if text("name", name, "the name of a result") not in table.results:
        raise InvalidRequest(f"name: expected the name of a result, got {name!r}; there are {', '.join(table.results)}")
    return name


def _is_random(table: Table, parameter: str) -> bool:
    """Whether the values are random samples: all different and not in order."""
    values = [row.parameters[parameter] for row in table.rows]
    ordered = sorted(values, key=float)
    return len(values) > 3 and len(set(values)) == len(values) and values not in (ordered, ordered[::-1])
