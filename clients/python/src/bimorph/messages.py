"""Values as they travel, and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from . import sweep as sweeps
from .errors import Diagnostic, InvalidRequest
from .options import WIRE
from .v1 import analysis_pb2, model_pb2

Voltages = Mapping[str, float]
"""Port voltages by name [V]; ports not named are at 0 V."""


def estimate_of(answer: Any) -> float | None:
    """Its error by the mesh [1]; None: there is no estimate."""
    return answer.estimated_error if answer.HasField("estimated_error") else None


def options_to_wire(settings: Mapping[str, float | str], options: Mapping[str, Any]) -> Any:
    """Netlist parameters and options of a model."""
    unknown = [name for name in options if name not in WIRE]
    if unknown:
        raise TypeError(f"no option {unknown[0]!r}; there are {', '.join(WIRE)}")
    given = {WIRE[name]: value for name, value in options.items() if value is not None}
    return model_pb2.CompileOptions(
        set=[sweeps.setting(name, value) for name, value in settings.items()], **given
    )


def setting_value(setting: Any) -> float | str:
    """Value of a netlist parameter."""
    value: float | str = setting.number if setting.WhichOneof("value") == "number" else setting.text
    return value


def diagnostic(d: Any) -> Diagnostic:
    """A message about a place in a netlist."""
    severity = "error" if d.severity == model_pb2.Diagnostic.SEVERITY_ERROR else "warning"
    return Diagnostic(d.code, severity, d.file, d.line, d.column, d.message, d.help)


def at_least(what: str, value: int, least: int) -> int:
    """A number that is given; the protocol takes 0 for one that is not."""
    if value < least:
        raise InvalidRequest(f"{what}: expected at least {least}, got {value}")
    return value


def listed(what: str, names: Sequence[str]) -> Sequence[str]:
    """Names, of which a text is none but a list of letters."""
    if isinstance(names, str):
        raise InvalidRequest(f'{what}: expected a list of names, got the text "{names}"; write ["{names}"]')
    return names


def named(voltages: Voltages | None) -> list[Any]:
    """Port voltages."""
    if voltages is not None and not isinstance(voltages, Mapping):
        raise InvalidRequest(f'voltages: expected names of ports with their volts, as {{"drive": 3.0}}, got {voltages!r}')
    return [analysis_pb2.Named(name=name, value=value) for name, value in (voltages or {}).items()]


def by_name(named: Iterable[Any]) -> dict[str, float]:
    """Named values as a dictionary."""
    return {n.name: n.value for n in named}
