"""Input waveforms of ports in a transient."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .aloud import MESH, text_of
from .arguments import integer, mapping, number, text, unmasked, wrong_type
from .errors import InvalidRequest, StepFailed
from .results import TransientResult
from .runs import Lane, advance, port_values
from .session import Session

Waveform = tuple[ArrayLike, ArrayLike]
"""Times [s], ascending, and values of the port [V, or the unit of its kind]. The waveform is piecewise linear, and constant before
and after."""

_SAME = 1e-14
"""Fraction of a run below which two times are equal."""
_EDGE = 1e-12
"""Shortest edge as a fraction of a run: well above :data:`_SAME`, so that its corners stay distinct."""
_STILL = 1e-6
"""Fraction of a signal's size below which its changes are rounding."""


def checked(inputs: Mapping[str, Waveform]) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Checked waveforms as arrays.

    Raises :class:`InvalidRequest`.
    """
    found = {}
    for port, wave in mapping("inputs", inputs, 'ports with their waveforms, as {"drive": (times, volts)}').items():
        where = f"inputs: input {text('inputs: name of a port', port, 'a text')!r}"
        if not isinstance(wave, (tuple, list)) or len(wave) != 2:
            raise wrong_type(where, "(times, values); hold a constant one by voltages={...};", wave)
        times, levels = (_numbers(where, part) for part in wave)
        if times.ndim != 1 or times.shape != levels.shape or times.size == 0:
            raise InvalidRequest(f"{where}: expected a list of times and as many values, got arrays of the shapes {times.shape} and {levels.shape}")
        if not (np.isfinite(times).all() and np.isfinite(levels).all()):
            name, part = ("times", times) if not np.isfinite(times).all() else ("values", levels)
            at = int(np.argmin(np.isfinite(part)))
            raise InvalidRequest(f"{where}: expected finite {name}, got {part[at]} at place {at}")
        if (np.diff(times) <= 0).any():
            late = int(np.argmax(np.diff(times) <= 0))
            raise InvalidRequest(f"{where}: expected times that ascend, got {times[late]:g} s before {times[late + 1]:g} s")
        found[port] = (times, levels)
    return found


def _numbers(where: str, values: Any) -> NDArray[np.float64]:
    unmasked(where, values)
    try:
        found = np.asarray(values)
    except (TypeError, ValueError):
        raise wrong_type(where, "times and values as lists of numbers", values) from None
    if found.size and found.dtype.kind not in "iuf":
        raise wrong_type(where, "times and values as lists of numbers", values)
    return found.astype(np.float64)


def drive(
    session: Session,
    inputs: Mapping[str, Waveform],
    stop: float,
    points: int,
    progress: Callable[[float], object] | None = None,
) -> TransientResult:
    """Steps a session along waveforms from 0 to ``stop`` [s] and reads its signals at ``points`` equally spaced times.

    The run begins in the static equilibrium of the inputs at time 0. Steps end at every corner of a waveform; the device divides them
    as necessary.
    """
    number("stop", stop, "a time in seconds", above=0.0)
    integer("points", points, 2)
    waves = checked(inputs)
    for port, (t, _) in waves.items():
        _long_enough(port, t, stop)
    output = np.linspace(0.0, stop, points)
    corners = [t[(t > 0.0) & (t < stop)] for t, _ in waves.values()]
    times = _apart(np.concatenate([output, *corners]), stop)

    start = {port: float(np.interp(times[0], *wave)) for port, wave in waves.items()}
    opening = session._operating_point(start)
    later = times[1:]
    values = port_values(session, {port: np.interp(later, *wave) for port, wave in waves.items()}, len(later))
    names = list(session.signals)
    lane = Lane.of(session, values, len(later), len(names), ports=False)
    advance([lane], later, names, ports=False, progress=progress)
    if lane.error:
        at = float(later[lane.done])
        raise StepFailed(f"step {lane.done}, to t = {at:.6g} s: {lane.error}")
    # omit steps that end at corners only
    wanted = np.searchsorted(later, output[1:])
    signals = {
        name: np.concatenate([[opening.outputs[name]], lane.outputs[wanted, k]]) for k, name in enumerate(names)
    }
    # the error of mesh and steps is estimated by a finer run
    warnings = tuple(text_of(one) for one in session.warnings if one.code != MESH)
    return TransientResult(output, signals, dict(session.signals), len(times) - 1, 0, session.unknowns, warnings=warnings)


def with_error_estimate(found: TransientResult, finer: TransientResult | None, tol: float) -> TransientResult:
    """The result with an error estimate: its distance from a finer run, relative to the amplitude of each unit."""
    if finer is None:
        warning = f"no error estimate of mesh and steps is available; the tolerance {tol:g} is not confirmed"
        return replace(found, warnings=(*found.warnings, warning))
    amplitude: dict[str, float] = {}
    for name, values in finer.signals.items():
        unit = finer.units[name]
        # a nearly constant signal is compared with its size
        amplitude[unit] = max(amplitude.get(unit, 0.0), float(np.ptp(values)), _STILL * float(np.abs(values).max()))
    errors = [
        float(np.sqrt(np.mean((values - finer.signals[name]) ** 2))) / amplitude[found.units[name]]
        for name, values in found.signals.items()
        if amplitude[found.units[name]] > 0.0
    ]
    error = max(errors, default=0.0)
    warnings = found.warnings
    if error > tol:
        warning = f"estimated error of mesh and steps: {error:.1e} of the amplitude, above the tolerance {tol:g}; give band or more segments"
        warnings = (*warnings, warning)
    return replace(found, estimated_error=error, warnings=warnings)


def _long_enough(port: str, times: NDArray[np.float64], stop: float) -> None:
    """Raises :class:`InvalidRequest` for an edge within the run whose corners are not distinct."""
    for start, end in zip(times, times[1:]):
        if end > 0.0 and start < stop and end - start < _EDGE * stop:
            raise InvalidRequest(
                f"inputs: input {port!r}: an edge of {end - start:.3g} s at {start:g} s; in a run of {stop:g} s it must last at least {_EDGE * stop:g} s"
            )


def _apart(times: NDArray[np.float64], stop: float) -> NDArray[np.float64]:
    """Ascending times, without those within rounding of the next one."""
    ordered = np.sort(times)
    keep: NDArray[np.bool_] = np.concatenate([np.diff(ordered) > _SAME * stop, [True]])
    return np.asarray(ordered[keep], dtype=float)

