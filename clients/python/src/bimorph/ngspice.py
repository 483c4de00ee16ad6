"""Runs decks in ngspice with the plug-in, and reads their waveforms. Requires the program ``bimorph`` and ngspice 39 or later."""

from __future__ import annotations

import math
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .errors import BimorphError, InvalidRequest, Unavailable
from .program import program


@dataclass(frozen=True, eq=False)
class Plot:
    """Waveforms of one analysis."""

    name: str
    """Name in ngspice: "Transient Analysis", "AC Analysis", …"""
    vectors: dict[str, NDArray[Any]]
    """Waveforms by name, the independent one first; complex in small-signal analyses. [V, A, s, Hz]"""

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self.vectors:
            raise KeyError(f"no vector {name!r}; there are {', '.join(self.vectors)}")
        return self.vectors[name]


@dataclass(frozen=True)
class Run:
    """Results of a deck."""

    plots: list[Plot]
    """One for each analysis, in the order in which ngspice ran them."""
    output: str = field(repr=False)
    """Output of ngspice."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A waveform of the last analysis."""
        return self.plots[-1][name]


def run(deck: str | os.PathLike[str], *, remote: str | None = None, timeout: float = 600.0) -> Run:
    """Runs a deck: a path, or its text (any string with a line break). File names in a text (netlists, ``.include``, ``.lib``) are relative to
    the working directory.

    ``remote`` is the address of a server that steps every device of the deck.

    Raises :class:`BimorphError` with the errors of ngspice and the device if the run has no result.
    """
    text = isinstance(deck, str) and "\n" in deck
    if text:
        arguments.text("deck", deck, "the text of a deck")
    else:
        arguments.content("deck", arguments.path("deck", deck, "a path, or the text of a deck"))
    remote = None if remote is None else arguments.text("remote", remote, "the address of a server")
    timeout = arguments.timeout("timeout", timeout)
    binary = program()
    if binary is None:
        raise Unavailable("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
    with tempfile.TemporaryDirectory(prefix="bimorph-") as folder:
        path = Path(folder) / "deck.cir" if text else Path(deck)
        if text:
            path.write_text(_absolute(str(deck)))
        raw = Path(folder) / "waves.raw"
        words = [binary, "cosim", str(path), "--out", str(raw)]
        words += ["--remote", remote] if remote else []
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=None if timeout == math.inf else timeout)
        except subprocess.TimeoutExpired:
            raise BimorphError(f"{path.name}: ngspice had no end after {timeout:g} s") from None
        if done.returncode != 0 or not raw.is_file():
            raise BimorphError(_reason(done.stderr) or _reason(done.stdout) or f"ngspice ended with {done.returncode}")
        return Run(read_raw(raw.read_bytes()), done.stdout)


_FILE = re.compile(r"""(\bfile\s*=\s*")([^"]+)(")""", re.IGNORECASE)
_INCLUDED = re.compile(r"""^([ \t]*\.(?:include|inc|lib)[ \t]+)(["']?)([^"'\s]+)\2""", re.IGNORECASE | re.MULTILINE)


def _absolute(text: str) -> str:
    """Makes file names of a deck absolute, because it is written to another folder."""

    def included(found: re.Match[str]) -> str:
        # `.lib NAME` can also begin a section
        path = os.path.abspath(found[3])
        return f'{found[1]}"{path}"' if os.path.isfile(path) else found[0]

    return _INCLUDED.sub(included, _FILE.sub(lambda m: m[1] + os.path.abspath(m[2]) + m[3], text))


def _reason(output: str) -> str:
    """The error lines in the output of a program; without any, its last lines."""
    lines = [line for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if re.search(r"error|fatal|singular|too small", line, re.IGNORECASE)]
    return "\n".join((errors or lines)[-8:])


def read_raw(content: bytes) -> list[Plot]:
    """Plots of a binary raw file.

    Raises :class:`ValueError` for another file.
    """
    content = arguments.instance("content", content, bytes, "the bytes of a raw file")
    plots = []
    while content.strip():
        head, found, content = content.partition(b"Binary:\n")
        if not found:
            raise InvalidRequest("content: not a binary raw file: no line 'Binary:'")
        text = head.decode("utf-8", "replace")
        entries = dict(re.findall(r"^([A-Z][\w. ]*?):[ \t]*(.*)$", text, re.MULTILINE))
        count, points = int(entries["No. Variables"]), int(entries["No. Points"])
        names = [line.split()[1] for line in text[text.index("Variables:\n") :].splitlines()[1 : count + 1]]
        kind: Any = np.complex128 if "complex" in entries["Flags"] else np.float64
        size = count * points * np.dtype(kind).itemsize
        if len(content) < size:
            raise InvalidRequest(f"content: the raw file ends within its numbers: {len(content)} bytes of {size}")
        table = np.frombuffer(content[:size], dtype=kind).reshape(points, count)
        content = content[size:]
        plots.append(Plot(entries["Plotname"].strip(), {name: table[:, k].copy() for k, name in enumerate(names)}))
    return plots
