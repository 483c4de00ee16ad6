"""Conversion of gdsfactory components into mechanisms, from their instances, settings and connected ports.

The source is ``get_netlist()`` of each component, so no geometry is recognised. The orientation of a nested cell is the product of all placements
around it; see :func:`bimorph.layout.from_gdsfactory`.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from .cells import Kind, Mechanism

_POWERS = {"m": -6, "s": -6}
"""Powers of ten of the SI units in which settings are given: micrometres and microseconds."""
_DRAWING = ("layer", "anchor")
"""Settings that select the masks of a cell."""
_DEEPEST = 100


@dataclass(frozen=True)
class _Place:
    """p ↦ (x, y) + R(angle)·(mirrored ? (px, −py) : p)."""

    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0
    mirrored: bool = False

    def after(self, inner: _Place) -> _Place:
        """``inner``, then this."""
        sign = -1.0 if self.mirrored else 1.0
        c, s = math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle))
        x, y = inner.x, sign * inner.y
        angle = (self.angle + sign * inner.angle) % 360.0
        return _Place(self.x + c * x - s * y, self.y + s * x + c * y, angle, self.mirrored != inner.mirrored)


@dataclass(frozen=True)
class _Part:
    """An instance of a cell of the library."""

    path: str
    kind: Kind
    settings: Mapping[str, Any]
    place: _Place


class _Nodes:
    """Sets of ports "path,port" that form one node."""

    def __init__(self) -> None:
        self._parent: dict[str, str] = {}
        self._names: dict[str, str] = {}
        self._roots: dict[str, str] = {}
        """Nodes of ports by instance name in the netlist."""

    def root(self, port: str) -> str:
        while self._parent.setdefault(port, port) != port:
            port = self._parent[port]
        return port

    def join(self, first: str, second: str) -> None:
        a, b = sorted((self.root(first), self.root(second)))
        self._parent[b] = a

    def call(self, port: str, name: str) -> None:
        """Names a node after a port of the top component. All joins and names precede the first query."""
        root, word = self.root(port), _word(name)
        if root in self._names:
            return
        other = self._roots.setdefault(word, root)
        if other != root:
            raise ValueError(f"ports {self._names[other]!r} and {name!r} are both called {word!r} in a netlist: rename one")
        self._names[root] = name

    def name(self, port: str) -> str:
        root = self.root(port)
        if root in self._names:
            return _word(self._names[root])
        plain = _word(root.replace(",", "_"))
        words = itertools.chain([plain], (f"{plain}_{k}" for k in itertools.count(2)))
        return next(word for word in words if self._roots.setdefault(word, root) == root)


def mechanism(component: Any, kinds: Mapping[str, Kind], process: str) -> Mechanism:
    """Mechanism of a component, or of the result of its ``get_netlist()``."""
    nodes = _Nodes()
    read, inner = _read(component)
    parts = list(_parts(read, inner, "", _Place(), kinds, nodes, 0))
    for name, port in dict(read.get("ports") or {}).items():
        nodes.call(str(port), str(name))
    made = Mechanism(process)
    words: dict[str, str] = {}
    groups = _Nodes()
    first: dict[str, tuple[str, _Place]] = {}
    for part in parts:
        word = _word(part.path)
        if words.setdefault(word, part.path) != part.path:
            raise ValueError(f"instances {words[word]!r} and {part.path!r} are both called {word!r} in a netlist: rename one")
        settings = {key: _scaled(part, key, value) for key, value in part.settings.items() if _told(key, value)}
        joined = {node: nodes.name(f"{part.path},{node}") for node in part.kind.nodes}
        made.add(word, part.kind(**settings), angle=_radians(part.place.angle), mirrored=part.place.mirrored, **joined)
        for node in joined.values():
            groups.join(node, joined[part.kind.nodes[0]])
        first.setdefault(joined[part.kind.nodes[0]], (word, part.place))
    _place(made, groups, first)
    return made


def _place(made: Mechanism, groups: _Nodes, first: Mapping[str, tuple[str, _Place]]) -> None:
    """Places parts without a connection to the first part: the first node of a cell is at its origin."""
    seen: dict[str, str] = {}
    origin: tuple[str, _Place] | None = None
    for node, (_, place) in first.items():
        origin = origin or (node, place)
        if groups.root(node) in seen:
            continue
        seen[groups.root(node)] = node
        if node != origin[0]:
            x, y = place.x - origin[1].x, place.y - origin[1].y
            made.place(origin[0], node, _metres(x), _metres(y))


def _read(component: Any) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """A netlist, and the instances of gdsfactory by name if available."""
    if isinstance(component, Mapping):
        return component, {}
    from gdsfactory.get_netlist import SmartNamer, function_namer, get_netlist

    smart = SmartNamer(function_namer)
    inner: dict[str, Any] = {}

    def name(inst: Any) -> str:
        called: str = smart(inst)
        inner[called] = inst
        return called

    # any number of ports in one place is one node; free ports are free ends; settings are not rounded
    read = get_netlist(
        component,
        on_multi_connect="ignore",
        on_dangling_port="ignore",
        instance_namer=name,
        port_matcher=_touch,
        serialization_max_digits=15,
    )
    return read, inner


def _touch(port1: Any, port2: Any) -> bool:
    """Whether two ports have the same position, regardless of width, layer and direction."""
    (x1, y1), (x2, y2) = port1.to_itype().center, port2.to_itype().center
    return bool(abs(x2 - x1) < 2 and abs(y2 - y1) < 2)


def _parts(
    read: Mapping[str, Any],
    inner: Mapping[str, Any],
    path: str,
    place: _Place,
    kinds: Mapping[str, Kind],
    nodes: _Nodes,
    depth: int,
) -> Iterator[_Part]:
    if depth > _DEEPEST:
        raise ValueError(f"components nest more than {_DEEPEST} deep at {path!r}")
    pairs = [(net["p1"], net["p2"]) for net in read.get("nets") or []]
    pairs += list(dict(read.get("connections") or {}).items())
    for one, other in pairs:
        nodes.join(f"{path}{one}", f"{path}{other}")
    for name, instance in read["instances"].items():
        cell = str(instance["component"])
        where = dict((read.get("placements") or {}).get(name) or {})
        if cell not in kinds and name not in inner:
            known = ", ".join(sorted(kinds))
            raise ValueError(f"instance {path + name!r} is a {cell!r}, which is no cell of the library: {known}")
        for called, local in _copies(name, instance, where, inner.get(name)):
            placed = place.after(local)
            if cell in kinds:
                yield _Part(path + called, kinds[cell], dict(instance.get("settings") or {}), placed)
                continue
            below, cells = _read(inner[name].cell)
            if not below["instances"]:
                known = ", ".join(sorted(kinds))
                raise ValueError(f"instance {path + name!r} is a {cell!r}, which is no cell of the library: {known}")
            yield from _parts(below, cells, f"{path}{called}/", placed, kinds, nodes, depth + 1)
            for port, inside in dict(below.get("ports") or {}).items():
                nodes.join(f"{path}{called},{port}", f"{path}{called}/{inside}")


def _copies(name: str, instance: Mapping[str, Any], where: Mapping[str, Any], known: Any) -> Iterator[tuple[str, _Place]]:
    """Instances of an array, named as in its ports; of another cell, the single one."""
    angle, mirrored = float(where.get("rotation") or 0.0), bool(where.get("mirror"))
    x, y = (float(where.get(axis) or 0.0) for axis in ("x", "y"))
    array = dict(instance.get("array") or {})
    if not array:
        yield name, _Place(x, y, angle, mirrored)
        return
    if known is not None:
        dbu = float(known.cell.kcl.dbu)
        counts = (int(known.na), int(known.nb))
        steps = [(dbu * step.x, dbu * step.y) for step in (known.a, known.b)]
    else:
        if "columns" in array:
            counts = (int(array["columns"]), int(array["rows"]))
            pitches = [(float(array["column_pitch"]), 0.0), (0.0, float(array["row_pitch"]))]
        else:
            counts = (int(array["num_a"]), int(array["num_b"]))
            pitches = [(float(array[key][0]), float(array[key][1])) for key in ("pitch_a", "pitch_b")]
        # they rotate with the cell but are not mirrored
        turned = [_Place(angle=angle).after(_Place(*pitch)) for pitch in pitches]
        steps = [(step.x, step.y) for step in turned]
    for a in range(max(counts[0], 1)):
        for b in range(max(counts[1], 1)):
            dx, dy = (a * steps[0][k] + b * steps[1][k] for k in (0, 1))
            yield f"{name}<{a}.{b}>", _Place(x + dx, y + dy, angle, mirrored)


def _scaled(part: _Part, key: str, value: Any) -> Any:
    if key not in part.kind.parameters:
        known = ", ".join(part.kind.parameters)
        raise ValueError(f"instance {part.path!r}: {part.kind.name} has no parameter {key!r}; there are {known}")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"instance {part.path!r}: {key} must be a number, got {value!r}")
    if not math.isfinite(value):
        raise ValueError(f"instance {part.path!r}: {key} must be a finite number, got {value!r}")
    return _shifted(value, _POWERS.get(part.kind.parameters[key][1], 0))


def _shifted(value: float, powers: int) -> float:
    """Scales by decimal digits: 20 µm is 2e-05 and not the rounded product."""
    return float(Decimal(repr(value)).scaleb(powers))


def _metres(micrometres: float) -> float:
    """Rounds to 1 fm, which exceeds the rounding of rotations."""
    return _shifted(round(micrometres, 9) + 0.0, -6)


def _told(key: str, value: Any) -> bool:
    return value is not None and key not in _DRAWING


def _radians(degrees: float) -> float:
    """Angle between −π and π; 0 for a full turn within rounding."""
    turned = (degrees + 180.0) % 360.0 - 180.0
    return 0.0 if abs(turned) < 1e-9 else math.radians(turned)


def _word(name: str) -> str:
    word = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return word if word[:1].isalpha() else f"n{word}"
