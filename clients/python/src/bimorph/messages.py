"""Conversion of values to and from messages."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any, get_type_hints

from . import arguments
from .errors import Diagnostic, InvalidType
from .options import WIRE, Options
from .sweep_wire import setting
from .v1 import analysis_pb2, model_pb2

Voltages = Mapping[str, float]
"""Port voltages by name [V]; ports not named are at 0 V."""


def estimate_of(answer: Any) -> float | None:
    """Estimated error of a result by the mesh [1]; None without an estimate."""
    return answer.estimated_error if answer.HasField("estimated_error") else None


def options_to_wire(settings: Mapping[str, float | str] | None, options: Mapping[str, Any]) -> Any:
    """Message of the netlist parameters and options of a model."""
    unknown = [name for name in options if name not in WIRE]
    if unknown:
        raise InvalidType(f"{unknown[0]}: no such option; there are {', '.join(WIRE)}")
    kinds = _kinds()
    checked = {name: arguments.of_annotation(name, value, kinds[name]) for name, value in options.items()}
    given = {WIRE[name]: value for name, value in checked.items() if value is not None}
    set = [setting(name, value) for name, value in arguments.settings("set", settings).items()]
    return model_pb2.CompileOptions(set=set, **given)


@functools.cache
def _kinds() -> dict[str, Any]:
    return get_type_hints(Options)


def setting_value(setting: Any) -> float | str:
    """Value of a netlist parameter from its message."""
    value: float | str = setting.number if setting.WhichOneof("value") == "number" else setting.text
    return value


def diagnostic(d: Any) -> Diagnostic:
    """A diagnostic from its message."""
    severity = "error" if d.severity == model_pb2.Diagnostic.SEVERITY_ERROR else "warning"
    return Diagnostic(d.code, severity, d.file, d.line, d.column, d.message, d.help)


def named(voltages: Voltages | None, argument: str = "voltages") -> list[Any]:
    """Messages of port voltages."""
    return [analysis_pb2.Named(name=name, value=value) for name, value in arguments.volts(argument, voltages).items()]


def by_name(named: Iterable[Any]) -> dict[str, float]:
    """Named values as a dictionary."""
    return {n.name: n.value for n in named}
