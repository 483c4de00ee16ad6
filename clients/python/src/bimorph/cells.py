"""Parametric cells, and mechanisms of cells joined at nodes.

Both :mod:`bimorph.layout`, which has the cells of the library, and the conversion of gdsfactory components build on these.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from .arguments import flag, instance, number
from .arguments import text as a_text
from .errors import InvalidRequest
from .netlist import Netlist

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")

POLY = (
    "process p1 = [ Youngsmodulus=165e9 Poisson=0.3 density=2300 h=2u viscosity=1.78e-5 fluid=2u permittivity=8.854e-12\n"
    "               sheetresistance=20 thermcond=30 thermalexpansion=2.33e-6 ambienttemperature=293 ]"
)
"""Structural polysilicon of 2 µm, the layer ``p1`` of the shipped process ``polymumps``."""


@dataclass(frozen=True)
class Kind:
    """A parametric cell: a subnet."""

    name: str
    """Name of the subnet."""
    nodes: tuple[str, ...]
    """Nodes, which are the ports of the cell."""
    parameters: Mapping[str, tuple[float, str]]
    """Default and unit of each parameter; lengths in metres."""
    body: str = field(repr=False)
    """Elements of the subnet; the layer is ``parent``."""
    optional: tuple[str, ...] = ()
    """Nodes that may stay unconnected."""

    def subnet(self) -> str:
        """The definition in SUGAR's language."""
        given = " ".join(f"{name}={value!r}" for name, (value, _) in self.parameters.items())
        return f"subnet {self.name} [{' '.join(self.nodes)}] [{given}]\n[\n{self.body.rstrip()}\n]\n"

    def __call__(self, **settings: float) -> Cell:
        """A cell with these settings [SI]."""
        unknown = sorted(set(settings) - set(self.parameters))
        if unknown:
            known = ", ".join(self.parameters)
            raise TypeError(f"{self.name} has no parameter {unknown[0]!r}; there are {known}")
        return Cell(self, {name: number(f"{self.name}: {name}", value) for name, value in settings.items()})


@dataclass(frozen=True)
class Cell:
    """A cell with its settings."""

    kind: Kind
    """Kind of the cell."""
    settings: Mapping[str, float]
    """Parameters that differ from their defaults [SI]."""


class Mechanism:
    """Cells joined at nodes."""

    def __init__(self, process: str = POLY) -> None:
        """``process`` defines the layer ``p1`` of all parts."""
        self.process = a_text("process", process, "the definition of a process")
        self._kinds: dict[str, Kind] = {}
        self._lines: list[str] = []
        self._names: set[str] = set()

    def add(self, name: str, cell: Cell, *, angle: float = 0.0, mirrored: bool = False, **nodes: str) -> None:
        """Adds an instance, mirrored about its x axis if ``mirrored`` and then rotated by ``angle`` [rad].

        ``nodes`` maps each node of the cell to a node of the mechanism; optional ones may be omitted.
        """
        _check_name("name", name)
        if name in self._names:
            raise InvalidRequest(f"name: there is an instance {name!r} already")
        kind = instance("cell", cell, Cell, "a cell of the library, as anchor() or comb(fingers=40)").kind
        angle, mirrored = number("angle", angle, "an angle in rad"), flag("mirrored", mirrored)
        nodes = {node: f"{name}_{node}" for node in kind.optional} | nodes
        missing = [node for node in kind.nodes if node not in nodes]
        unknown = sorted(set(nodes) - set(kind.nodes))
        if missing or unknown:
            raise ValueError(f"{kind.name} has the nodes {', '.join(kind.nodes)}; got {', '.join(nodes) or 'none'}")
        for end, node in nodes.items():
            _check_name(end, node)
        if self._kinds.setdefault(kind.name, kind) != kind:
            raise ValueError(f"there is another cell called {kind.name!r}")
        self._names.add(name)
        given = [f"{key}={value!r}" for key, value in cell.settings.items()]
        if angle:
            given.append(f"oz={float(angle)!r}")
        if mirrored:
            given.append("ox=pi")
        joined = " ".join(nodes[node] for node in kind.nodes)
        self._lines.append(f"{name} {kind.name} p1 [{joined}] [{' '.join(given)}]")

    def place(self, origin: str, node: str, x: float, y: float) -> None:
        """Places ``node`` at (x, y) [m] from ``origin``, for unconnected parts."""
        _check_name("origin", origin)
        _check_name("node", node)
        x, y = number("x", x, "a length in m"), number("y", y, "a length in m")
        self._lines.append(f"pos * [{origin} {node}] [x={x!r} y={y!r}]")

    def line(self, text: str) -> None:
        """Adds a line of netlist: a port, a load, a ground."""
        self._lines.append(a_text("text", text, "a line of a netlist", empty=True))

    def netlist(self, name: str = "mechanism.net") -> Netlist:
        """Netlist of the mechanism."""
        subnets = "\n".join(kind.subnet() for kind in self._kinds.values())
        a_text("name", name, "the name of a file")
        return Netlist.text(f"{self.process}\n\n{subnets}\n" + "\n".join(self._lines) + "\n", name)


def _check_name(argument: str, name: str) -> None:
    if not _NAME.match(a_text(argument, name, "a name")):
        raise InvalidRequest(f"{argument}: {name!r} is no name: expected letters, digits and _, a letter first")
