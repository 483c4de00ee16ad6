"""Results as xarray datasets with units; xarray is imported at first use."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

    from .table import Table


def dataset(
    axis: tuple[str, Any, str], columns: Mapping[str, Any], units: Mapping[str, str], about: Mapping[str, Any]
) -> xarray.Dataset:
    """Arrays over one axis (name, values, unit), each with its unit; values of ``about`` other than None become attributes."""
    xr = _xarray()
    name, values, unit = axis
    variables = {column: (name, np.asarray(array), {"units": units.get(column, "")}) for column, array in columns.items()}
    attributes = {key: value for key, value in about.items() if value is not None}
    found: xarray.Dataset = xr.Dataset(variables, coords={name: (name, np.asarray(values), {"units": unit})}, attrs=attributes)
    return found


def of_sessions(t: Any, columns: Mapping[str, Any], units: Mapping[str, str]) -> xarray.Dataset:
    """Arrays over sessions and times [s], each with its unit."""
    xr = _xarray()
    variables = {name: (("session", "t"), np.asarray(values), {"units": units[name]}) for name, values in columns.items()}
    count = max((len(values) for values in columns.values()), default=0)
    found: xarray.Dataset = xr.Dataset(variables, coords={"session": np.arange(count), "t": ("t", np.asarray(t), {"units": "s"})})
    return found


def of_table(table: Table) -> xarray.Dataset:
    """Dataset of a sweep: of a full grid with an axis for each parameter, otherwise over points with the parameters as coordinates."""
    xr = _xarray()
    values = {name: list(dict.fromkeys(row.parameters[name] for row in table.rows)) for name in table.parameters}
    sizes = [len(one) for one in values.values()]
    is_grid = bool(sizes) and math.prod(sizes) == len(table.rows) and len({tuple(row.parameters.values()) for row in table.rows}) == len(table.rows)
    results = {name: [row.results.get(name, math.nan) for row in table.rows] for name in table.results}
    texts = {"error": [row.error for row in table.rows], "warning": [row.warning for row in table.rows]}
    estimates = [math.nan if row.estimated_error is None else row.estimated_error for row in table.rows]
    called = {name: f"{name} [{table.units[name]}]" if name in table.parameters else name for name in table.results}
    every: list[tuple[str, Sequence[Any], str]] = [(called[name], column, table.units[name]) for name, column in results.items()]
    every += [("estimated_error", estimates, "1"), *((name, column, "") for name, column in texts.items())]
    if not is_grid:
        points = [row.point for row in table.rows]
        coordinates: dict[str, Any] = {name: ("point", [row.parameters[name] for row in table.rows]) for name in table.parameters}
        columns = {name: ("point", np.asarray(column), {"units": unit}) for name, column, unit in every}
        by_point: xarray.Dataset = xr.Dataset(columns, coords={"point": points, **coordinates})
        return by_point
    places = [tuple(values[name].index(row.parameters[name]) for name in table.parameters) for row in table.rows]
    grids: dict[str, Any] = {}
    for name, column, unit in every:
        array = np.asarray(column)
        grid = np.empty(sizes, dtype=array.dtype)
        for place, value in zip(places, array):
            grid[place] = value
        grids[name] = (tuple(values), grid, {"units": unit})
    found: xarray.Dataset = xr.Dataset(grids, coords=dict(values))
    return found


def _xarray() -> Any:
    try:
        import xarray
    except ImportError:
        raise ImportError("to_xarray() needs xarray: pip install xarray") from None
    return xarray
