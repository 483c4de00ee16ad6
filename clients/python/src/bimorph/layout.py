"""Layouts: parametric cells that are subnets, and gdsfactory components made of them.

A cell of this library is drawn by ``bimorph layout`` and modelled by its subnet, so no geometry has to be
recognised. :class:`Cell` objects are joined in a :class:`Mechanism`, whose :meth:`Mechanism.netlist` is compiled like any other::

    from bimorph import layout
    m = layout.Mechanism()
    m.add("spring", layout.folded_flexure(length=200e-6, width=2e-6), c="shuttle")
    m.add("drive", layout.comb(fingers=40), a="shuttle", b="pad")
    m.add("pad_anchor", layout.anchor(), a="pad")
    model = client.compile(m.netlist())

With gdsfactory installed, :mod:`bimorph.pcells` has the same cells as gdsfactory cells, with outlines and ports. :func:`from_gdsfactory`
converts a component into a mechanism: it takes instances of the cells of this library by name, their settings as parameters, and joins
ports with the same position. Lengths of gdsfactory are in micrometres, those of this module in metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .arguments import instance, mapping, wrong, wrong_type
from .arguments import text as a_text
from .cells import POLY, Cell, Kind, Mechanism
from .component import mechanism

__all__ = [
    "KINDS", "POLY", "Cell", "Kind", "Mechanism", "anchor", "bimorph", "comb", "folded_flexure", "from_gdsfactory", "plain_beam", "serpentine",
]

anchor = Kind(
    "anchor_pad",
    ("a",),
    {"length": (10e-6, "m"), "width": (10e-6, "m")},
    "  anchor parent [a] [l=length w=width]\n",
)
"""A pad that anchors its node."""

folded_flexure = Kind(
    "folded_flexure",
    ("c", "left", "right"),
    {
        "length": (200e-6, "m"),
        "width": (2e-6, "m"),
        "pitch": (20e-6, "m"),
        "half": (40e-6, "m"),
        "foot": (40e-6, "m"),
        "truss": (10e-6, "m"),
    },
    """  plate2d parent [c] [l=2*half w=2*foot]
  link2d * [c left] [l=half oz=pi]
  link2d * [c right] [l=half]
  wire * [c left right] []
  for s=0:1
  [
    up = cond(s, -1, 1)
    for k=0:1
    [
      side = cond(k, -1, 1)
      link2d * [c foot(s,k)] [l=sqrt(half^2+foot^2) oz=atan2(up*foot, side*half)]
      inner(s,k) beam2d parent [foot(s,k) top(s,k)] [l=length w=width oz=up*pi/2]
      end(s,k) beam2d parent [top(s,k) corner(s,k)] [l=pitch w=truss oz=cond(k, pi, 0)]
      outer(s,k) beam2d parent [corner(s,k) pad(s,k)] [l=length w=width oz=-up*pi/2]
      anchor parent [pad(s,k)] [l=10u w=10u oz=-up*pi/2]
    ]
    trusses(s) beam2d parent [top(s,1) top(s,0)] [l=2*half w=truss]
  ]
""",
    optional=("left", "right"),
)
"""A shuttle on a flexure folded over two trusses; it moves along x. ``c`` is its centre, ``left`` and ``right`` are its edges."""

comb = Kind(
    "comb_drive",
    ("a", "b"),
    {
        "fingers": (20.0, "1"),
        "gap": (2e-6, "m"),
        "overlap": (20e-6, "m"),
        "length": (40e-6, "m"),
        "finger": (2e-6, "m"),
        "spine": (8e-6, "m"),
    },
    """  pitch = finger + gap
  tall = 2*fingers*pitch + finger
  turn = length*length + finger*finger
  more = fingers + 1
  link2d * [a ma] [l=spine/2]
  back plate2d parent [ma] [l=spine w=tall]
  link2d * [a fa] [l=spine+length/2]
  rotor body2d parent [fa] [A=more*length*finger Ip=more*length*finger*(turn/12 + pitch^2*(more^2-1)/3)]
  drive comb2de parent [a b] [N=2*fingers gap=gap l=overlap L=length+spine w=finger]
  link2d * [b mb] [l=spine/2 oz=pi]
  front plate2d parent [mb] [l=spine w=tall]
  link2d * [b fb] [l=spine+length/2 oz=pi]
  stator body2d parent [fb] [A=fingers*length*finger Ip=fingers*length*finger*(turn/12 + pitch^2*(fingers^2-1)/3)]
""",
)
"""A comb drive: ``fingers`` on the side of ``b`` between ``fingers + 1`` on the side of ``a``, hence twice as many gaps as fingers. Each side has
a spine. ``b`` lies ahead of ``a`` along local x; both are on the outer edges of their spines."""

bimorph = Kind(
    "thermal_bimorph",
    ("a", "g", "o"),
    {
        "length": (206e-6, "m"),
        "hot": (2e-6, "m"),
        "cold": (8e-6, "m"),
        "cold_length": (112e-6, "m"),
        "flexure": (1.9e-6, "m"),
        "spacing": (23e-6, "m"),
        "bar": (13e-6, "m"),
        "link": (24e-6, "m"),
        "tau": (230e-6, "s"),
    },
    """  anchor parent [a] [l=10u w=10u oz=pi]
  hot beam2det parent [a t] [l=length w=hot tau=tau]
  bar beam2det parent [t c] [l=spacing w=bar oz=-pi/2 tau=tau]
  cold beam2det parent [c f] [l=cold_length w=cold oz=pi tau=tau]
  flex beam2det parent [f g] [l=length-cold_length w=flexure oz=pi tau=tau]
  anchor parent [g] [l=10u w=10u oz=pi]
  link beam2d parent [c o] [l=link w=3u]
""",
)
"""A hot-arm/cold-arm electrothermal actuator (not a bilayer): a hot and a cold arm between the pads ``a`` and ``g``; its tip is linked to ``o``."""

serpentine = Kind(
    "serpentine",
    ("a", "b"),
    {"turns": (4.0, "1"), "length": (100e-6, "m"), "pitch": (10e-6, "m"), "width": (2e-6, "m")},
    """  first beam2d parent [a up(0)] [l=length/2 w=width oz=pi/2]
  for k=1:turns
  [
    across(2*k-1) beam2d parent [up(k-1) down(k)] [l=pitch w=width]
    fall(k) beam2d parent [down(k) low(k)] [l=length w=width oz=-pi/2]
    across(2*k) beam2d parent [low(k) rise(k)] [l=pitch w=width]
    if k < turns [ climb(k) beam2d parent [rise(k) up(k)] [l=length w=width oz=pi/2] ]
  ]
  last beam2d parent [rise(turns) b] [l=length/2 w=width oz=pi/2]
""",
)
"""A meander along x with long beams along y, from ``a`` to ``b``."""

plain_beam = Kind(
    "plain_beam",
    ("a", "b"),
    {"length": (100e-6, "m"), "width": (2e-6, "m")},
    "  bar beam2d parent [a b] [l=length w=width]\n",
)
"""A straight beam along x, from ``a`` to ``b``."""

KINDS: dict[str, Kind] = {kind.name: kind for kind in (anchor, plain_beam, folded_flexure, comb, bimorph, serpentine)}
"""Cells of this library by the name of their subnet."""


def from_gdsfactory(component: Any, *, kinds: Mapping[str, Kind] | None = None, process: str = POLY) -> Mechanism:
    """A mechanism from a gdsfactory component made of cells whose names are those of :data:`KINDS` (or ``kinds``).

    ``component`` is a component, or the result of its ``get_netlist()``. Settings of an instance are parameters of its subnet (lengths in
    micrometres, times in microseconds). Its ports are nodes; ports with the same position are one node. Arrays become instances, nested
    components are flattened, and mirrors and rotations are kept. Unconnected parts are placed by the origins of their cells, where the first
    node of each cell is. An instance of an unknown cell, or with an unknown setting, raises an error with its name.
    """
    a_text("process", process, "the definition of a process")
    found = KINDS if kinds is None else mapping("kinds", kinds, "cells by the names of their components")
    for name, kind in found.items():
        instance(f"kinds[{name!r}]", kind, Kind, "a cell of the library")
    if not isinstance(component, Mapping) and not hasattr(component, "get_netlist"):
        raise wrong_type("component", "a component of gdsfactory, or what its get_netlist() gives", component)
    if isinstance(component, Mapping) and not isinstance(component.get("instances"), Mapping):
        raise wrong("component", "a netlist of gdsfactory, with its instances by name", component)
    return mechanism(component, found, process)
