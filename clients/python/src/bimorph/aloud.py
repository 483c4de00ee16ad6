"""Warnings of models and results as Python warnings; ``-W error`` turns them into exceptions."""

import warnings
from collections.abc import Iterable

from .errors import Diagnostic

MESH = "W040"
"""Code of warnings about the mesh of sessions; analyses choose their own mesh."""


class NetlistWarning(UserWarning):
    """A netlist is valid but probably not as intended. The text has place, code and remedy."""


class AccuracyWarning(UserWarning):
    """A result may deviate by more than its tolerance, or the model is outside its range of validity. The text has the estimate or the reason."""


def issue(texts: Iterable[str], level: int = 3) -> tuple[str, ...]:
    """Issues a warning for each text, located at the caller's caller; returns the texts."""
    found = tuple(texts)
    for text in found:
        warnings.warn(text, AccuracyWarning, stacklevel=level)
    return found


def of_netlist(diagnostics: Iterable[Diagnostic], level: int = 3) -> None:
    """Issues the warnings of a netlist, apart from those about its mesh."""
    for one in diagnostics:
        if one.severity == "warning" and one.code != MESH:
            place = f"{one.file}:{one.line}: " if one.line else ""
            help = f" ({one.help})" if one.help else ""
            warnings.warn(f"{place}{one.message} [{one.code}]{help}", NetlistWarning, stacklevel=level)


def of_mesh(diagnostics: Iterable[Diagnostic], level: int = 3) -> None:
    """Issues the warnings about the mesh of a session."""
    for one in diagnostics:
        if one.code == MESH:
            warnings.warn(f"{one.message} ({one.help})", AccuracyWarning, stacklevel=level)


def of_states(diagnostics: Iterable[Diagnostic], level: int = 3, about: str = "") -> None:
    """Issues the warnings of accepted states, each text after ``about``."""
    for one in diagnostics:
        warnings.warn(f"{about}{text_of(one)}", AccuracyWarning, stacklevel=level)


def text_of(one: Diagnostic) -> str:
    """A warning as one line: code, message and remedy."""
    return f"{one.code}: {one.message}" + (f" ({one.help})" if one.help else "")
