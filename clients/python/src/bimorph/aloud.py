"""What is said aloud: as warnings of Python, which a test runner shows and ``-W error`` makes errors of."""

import warnings
from collections.abc import Iterable

from .errors import Diagnostic

MESH = "W040"
"""Code of what is said of a mesh: it concerns sessions, analyses choose their own."""


class NetlistWarning(UserWarning):
    """A netlist may not mean what was meant. The text has place, code and a way out."""


class AccuracyWarning(UserWarning):
    """A number may be off by more than its tolerance, or a model be beyond its range. The text says by how much, or why."""


def said(texts: Iterable[str], level: int = 3) -> tuple[str, ...]:
    """Warns of each, where the caller of the caller stands; answers them."""
    told = tuple(texts)
    for text in told:
        warnings.warn(text, AccuracyWarning, stacklevel=level)
    return told


def of_netlist(diagnostics: Iterable[Diagnostic], level: int = 3) -> None:
    """Warns of what a netlist is warned of, apart from its mesh."""
    for told in diagnostics:
        if told.severity == "warning" and told.code != MESH:
            place = f"{told.file}:{told.line}: " if told.line else ""
            help = f" ({told.help})" if told.help else ""
            warnings.warn(f"{place}{told.message} [{told.code}]{help}", NetlistWarning, stacklevel=level)


def of_mesh(diagnostics: Iterable[Diagnostic], level: int = 3) -> None:
    """Warns of what is known of the mesh that a session has."""
    for told in diagnostics:
        if told.code == MESH:
            warnings.warn(f"{told.message} ({told.help})", AccuracyWarning, stacklevel=level)
