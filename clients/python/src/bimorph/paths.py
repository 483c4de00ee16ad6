"""Equilibrium paths: requests, replies and results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from . import arguments, labelled, plots, showing
from .errors import InvalidRequest
from .messages import Voltages, estimate_of, named
from .results import NodeMotion
from .v1 import path_pb2

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

Branch = Literal["plus", "minus", "stay"]
"""Branch at a bifurcation: along the buckling shape, against it, or straight on."""
PathEnd = Literal["arrived", "turned back", "unstable", "as many points as allowed", "lost"]
"""Reason for the end of a path."""

_ENDS: tuple[PathEnd, ...] = get_args(PathEnd)


@dataclass(frozen=True)
class CriticalPoint:
    """A limit point or a bifurcation of a path."""

    value: float
    """Value of the parameter, in its unit."""
    point: int
    """Index of the point in the arrays of the path."""


@dataclass(frozen=True, eq=False, repr=False)
class PathResult:
    """Equilibria along a parameter, in the order of the path; the parameter may turn back."""

    along: str
    """Name of the parameter."""
    unit: str
    """Unit of the parameter; empty if its effects do not determine it."""
    values: NDArray[np.float64]
    """Value of the parameter at each point."""
    signals: dict[str, NDArray[np.float64]]
    """Each signal at each point, in its unit."""
    units: dict[str, str]
    """Unit of each signal."""
    negative: NDArray[np.int64]
    """Number of negative eigenvalues of the stiffness at each point; 0 if the equilibrium is stable at fixed loads and voltages."""
    limit_points: tuple[CriticalPoint, ...]
    """Points at which the parameter turns back: pull-in, release, snap-through."""
    bifurcations: tuple[CriticalPoint, ...]
    """Points at which other branches cross: buckling."""
    end: PathEnd
    """Reason for the end of the path."""
    last: dict[str, NodeMotion]
    """Displacement of every mechanical node at the last point."""
    unknowns: int
    """Mechanical unknowns."""
    iterations: int
    """Newton iterations."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh, of critical points and of the end [1]; None without an estimate."""
    warnings: tuple[str, ...] = ()
    """Warnings about the result."""

    def __repr__(self) -> str:
        ends = f"{self.values[0]:g} to {self.values[-1]:g}" if len(self.values) else "nowhere"
        return f"<PathResult along {self.along} from {ends}: {len(self.values)} points, {len(self.limit_points)} limit points, {self.end}>"

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the equilibrium is stable at fixed loads and voltages, at each point."""
        return np.asarray(self.negative == 0, dtype=np.bool_)

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each signal and ``negative``, by value of the parameter; ``attrs["units"]`` has the units."""
        columns = {**self.signals, "negative": self.negative}
        return showing.frame(columns, (self.along, self.values), {self.along: self.unit, **self.units, "negative": "1"})

    def to_xarray(self) -> xarray.Dataset:
        """The columns of :meth:`to_pandas` by number of the point, with the parameter as the coordinate ``value``; each array has its unit in
        ``attrs["units"]``."""
        about = {"along": self.along, "end": self.end, "estimated_error": self.estimated_error}
        columns = {**self.signals, "negative": self.negative}
        found = labelled.dataset(("point", range(len(self.values)), ""), columns, {**self.units, "negative": "1"}, about)
        return found.assign_coords(value=("point", self.values, {"units": self.unit, "long_name": self.along}))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws every signal over the parameter: solid where stable, dashed where unstable, with limit points (dots) and bifurcations (squares)."""
        return plots.path(self, ax)

    def _repr_html_(self) -> str:
        critical = [("limit point", one.point) for one in self.limit_points] + [("bifurcation", one.point) for one in self.bifurcations]
        rows = [("start", 0), *sorted(critical, key=lambda row: row[1]), ("end", len(self.values) - 1)] if len(self.values) else []
        head = ["point", f"{self.along} [{self.unit}]", *(f"{name} [{unit}]" for name, unit in self.units.items()), "stable"]
        cells = [
            (what, float(self.values[k]), *(float(column[k]) for column in self.signals.values()), "yes" if self.stable[k] else "no")
            for what, k in rows
        ]
        return showing.table(head, cells, showing.note(self.estimated_error, [f"{len(self.values)} points, {self.end}", *self.warnings]))


def request_of(
    model: str, along: str, span: tuple[float, float], signals: Sequence[str], branch: Branch, points: int, voltages: Voltages | None
) -> Any:
    """Checked message of a path between the two values of ``span``."""
    along = arguments.text("along", along, "the name of a port, of a parameter of the netlist, or loads")
    start, stop = arguments.number("start", span[0]), arguments.number("stop", span[1])
    if start == stop:
        raise InvalidRequest(f"stop: expected another value than start, got {stop:g} as well")
    branches: dict[str, Any] = {word: number for number, word in enumerate(get_args(Branch))}
    return path_pb2.PathRequest(
        model=model,
        along=along,
        to=stop,
        signals=arguments.names("signals", signals),
        branch=branches[arguments.choice("branch", branch, branches)],
        points=arguments.integer("points", points, 2),
        voltages=named(voltages),
        **{"from": start},
    )


def path_of(answer: Any, along: str) -> PathResult:
    """The path from a verified message."""

    def critical(points: Any) -> tuple[CriticalPoint, ...]:
        return tuple(CriticalPoint(one.value, one.point) for one in points)

    return PathResult(
        along=along,
        unit=answer.unit,
        values=np.array(answer.values, dtype=np.float64),
        signals={s.name: np.array(s.values, dtype=np.float64) for s in answer.signals},
        units={s.name: s.unit for s in answer.signals},
        negative=np.array(answer.negative, dtype=np.int64),
        limit_points=critical(answer.limit_points),
        bifurcations=critical(answer.bifurcations),
        end=_ENDS[answer.end] if 0 <= answer.end < len(_ENDS) else "lost",
        last={n.name: NodeMotion(n.x, n.y, n.rz) for n in answer.last},
        unknowns=answer.unknowns,
        iterations=answer.iterations,
        estimated_error=estimate_of(answer),
        warnings=tuple(answer.warnings),
    )
