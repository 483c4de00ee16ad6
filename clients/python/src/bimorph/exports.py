"""Models for other simulators: requests, replies and results."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from . import arguments, labelled, plots, showing
from .errors import InvalidRequest
from .messages import Voltages, estimate_of, named
from .v1 import export_pb2

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

Language = Literal["spice", "verilog-a"]
"""A SPICE subcircuit or a Verilog-A module."""
Scales = Sequence[str] | Mapping[str, float]
"""Names, or names with their scale in volts per unit."""

_UNITS = {"frequency_hz": "Hz", "quality": "1"}
"""Numbers of a mode, and their units."""


@dataclass(frozen=True, eq=False, repr=False)
class ExportResult:
    """A model for another simulator, as text."""

    text: str
    """The file."""
    language: Language
    """Its language."""
    name: str
    """Name of its subcircuit or module."""
    pins: tuple[str, ...]
    """Its pins, in order: a positive and a negative one for each port, then one for each signal."""
    nonlinear: bool
    """Whether it is a nonlinear model, not the linear one about an operating point."""
    numbers: tuple[int | None, ...] = ()
    """Number of each mode of a linear model among the undamped modes, from 1; None for a direction of the static correction."""
    frequencies_hz: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Frequency of each mode of a linear model [Hz]."""
    quality: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """Quality factor of each mode of a linear model [1]; infinite without damping."""
    lags: int = 0
    """Lags of heat of a linear or reduced nonlinear model."""
    error: float | None = None
    """Largest relative deviation of a linear model from the exact small-signal response within ``band_hz`` [1], of a reduced nonlinear model from
    the equilibria in ``ranges``; None for the whole model of parts that slide."""
    band_hz: tuple[float, float] | None = None
    """Band of that comparison [Hz]."""
    unknowns: int | None = None
    """Mechanical unknowns of the full model; None for a nonlinear model."""
    directions: int | None = None
    """Directions in which parts of a nonlinear model slide; None for a linear or reduced model."""
    gaps: int | None = None
    """Gaps of a nonlinear model of parts that slide; None for a linear or reduced model."""
    coordinates: int | None = None
    """Coordinates of a reduced nonlinear model; None for others."""
    ranges: tuple[tuple[float, float], ...] = ()
    """Range of what is given to each port of a reduced nonlinear model, in its unit; empty for others."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh [1]; None without an estimate."""
    warnings: tuple[str, ...] = ()
    """Limitations of the file that the numbers do not show."""

    def __repr__(self) -> str:
        what = self._nonlinear() or f"{len(self.numbers)} modes"
        return f"<ExportResult {self.name} in {self.language}: {what}, {len(self.pins)} pins>"

    def _nonlinear(self) -> str:
        if self.coordinates is not None:
            return f"{self.coordinates} coordinates"
        return f"{self.directions} directions in which parts slide, {self.gaps} gaps" if self.nonlinear else ""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file."""
        file = arguments.path("path", path)
        try:
            with open(file, "w", encoding="utf-8", newline="\n") as opened:
                opened.write(self.text)
        except OSError as error:
            raise type(error)(error.errno, f"path: {error.strerror}", file) from None

    def to_pandas(self) -> pandas.DataFrame:
        """Frequency [Hz] and quality factor of every mode, by number from 1; ``attrs["units"]`` has the units."""
        return showing.frame(self._columns(), ("mode", range(1, len(self.numbers) + 1)), _UNITS)

    def to_xarray(self) -> xarray.Dataset:
        """The columns of :meth:`to_pandas`, each with its unit in ``attrs["units"]``."""
        about = {"name": self.name, "language": self.language, "error": self.error, "estimated_error": self.estimated_error}
        return labelled.dataset(("mode", range(1, len(self.numbers) + 1), ""), self._columns(), _UNITS, about)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the quality factor of every mode over its frequency, both on logarithmic scales; vertical lines are undamped modes."""
        return plots.export(self, ax)

    def _columns(self) -> dict[str, NDArray[np.float64]]:
        return {"frequency_hz": self.frequencies_hz, "quality": self.quality}

    def _repr_html_(self) -> str:
        rows = [("static" if n is None else n, f, q) for n, f, q in zip(self.numbers, self.frequencies_hz.tolist(), self.quality.tolist())]
        what = f"{self.name} {' '.join(self.pins)}"
        within = [] if self.error is None else [f"within {self.error:.1e} of the full model"]
        slide = [self._nonlinear()] if self.nonlinear else []
        return showing.table(["mode", "frequency [Hz]", "Q"], rows, showing.note(self.estimated_error, [what, *within, *slide, *self.warnings]))


def _scaled(name: str, value: Scales) -> list[Any]:
    """Messages of names with their scales."""
    if not isinstance(value, Mapping):
        return [export_pb2.Scaled(name=one) for one in arguments.names(name, value)]
    found = []
    for key, scale in value.items():
        label = arguments.text(f"{name}: a name", key, "a text")
        scale = arguments.number(f"{name}[{key!r}]", scale, "a scale in volts per unit")
        if scale == 0.0:
            raise arguments.wrong(f"{name}[{key!r}]", "a scale other than 0", scale)
        found.append(export_pb2.Scaled(name=label, scale=scale))
    return found


def _ranges(ranges: Any) -> list[Any]:
    """Messages of the ranges of ports."""
    found = []
    for key, ends in ({} if ranges is None else arguments.mapping("ranges", ranges, "None or ports with their low and high ends")).items():
        label, name = arguments.text("ranges: a port", key, "a text"), f"ranges[{key!r}]"
        both = arguments.items(name, ends, "a low and a high end")
        if len(both) != 2:
            raise arguments.wrong(name, "a low and a high end", ends)
        low, high = (arguments.number(name, end, "a low and a high end") for end in both)
        if not low < high:
            raise arguments.wrong(name, "a low end below the high one", ends)
        found.append(export_pb2.PortRange(name=label, low=low, high=high))
    return found


def request_of(
    model: str,
    language: Language,
    ports: Scales,
    signals: Scales,
    voltages: Voltages | None,
    to: float | None,
    within: float | None,
    count: int | None,
    name: str | None,
    nonlinear: bool,
    ranges: Mapping[str, tuple[float, float]] | None,
) -> Any:
    """Checked message of an export."""
    languages: dict[str, Any] = {word: number for number, word in enumerate(get_args(Language))}
    request = export_pb2.ExportRequest(
        model=model,
        language=languages[arguments.choice("language", language, languages)],
        nonlinear=arguments.flag("nonlinear", nonlinear),
        ports=_scaled("ports", ports),
        signals=_scaled("signals", signals),
        voltages=named(voltages),
        to_hz=0.0 if to is None else arguments.number("to", to, "None or a frequency in Hz", above=0.0),
        within=0.0 if within is None else arguments.number("within", within, "None or a relative deviation", least=1e-9, below=1.0),
        count=0 if count is None else arguments.integer("count", count, 1, 1000),
        name="" if name is None else arguments.text("name", name, "None or the name of a subcircuit or module"),
        ranges=_ranges(ranges),
    )
    if ranges and not request.nonlinear:
        raise InvalidRequest(f"ranges: expected none without nonlinear, got {arguments.shown(ranges)}; a linear model has an operating point")
    if request.nonlinear:
        for argument, given in (("voltages", voltages or None), ("to", to), ("count", count)):
            if given is not None:
                why = "the nonlinear model has no operating point"
                raise InvalidRequest(f"{argument}: expected none together with nonlinear, got {arguments.shown(given)}; {why}")
    return request


def export_of(answer: Any, language: Language) -> ExportResult:
    """The file from a verified message."""
    linear, whole = answer.linear, answer.nonlinear
    shared: dict[str, Any] = {"estimated_error": estimate_of(answer), "warnings": tuple(answer.warnings)}
    if answer.WhichOneof("content") == "nonlinear":
        return ExportResult(answer.text, language, answer.name, tuple(answer.pins), True, directions=whole.directions, gaps=whole.gaps, **shared)
    if answer.WhichOneof("content") == "reduced":
        of = answer.reduced
        about = {"coordinates": of.coordinates, "lags": of.lags, "error": of.error, "ranges": tuple((r.low, r.high) for r in of.ranges)}
        return ExportResult(answer.text, language, answer.name, tuple(answer.pins), True, **about, **shared)
    return ExportResult(
        answer.text,
        language,
        answer.name,
        tuple(answer.pins),
        False,
        numbers=tuple(number or None for number in linear.numbers),
        frequencies_hz=np.array(linear.frequencies_hz, dtype=np.float64),
        quality=np.array(linear.quality, dtype=np.float64),
        lags=linear.lags,
        error=linear.error,
        band_hz=(linear.from_hz, linear.to_hz),
        unknowns=linear.unknowns,
        **shared,
    )
