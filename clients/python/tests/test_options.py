"""Every option of a model is a keyword of ``compile``: the server refuses a value beyond its range, the client an unknown one."""

from __future__ import annotations

from typing import Any

import pytest
from conftest import PLATE

import bimorph

NETLIST = bimorph.Netlist.text(PLATE, "plate.net")


def test_every_option_reaches_the_server(client: bimorph.Client) -> None:
    """An option that is left out, None, or at its default is the same model; each other value is another."""
    plain = client.compile(NETLIST).id
    assert client.compile(NETLIST, tol=None, shear=False, junctions=None, formulation="auto").id == plain
    others: list[Any] = [
        {"tol": 1e-4},
        {"band": 1e6},
        {"junctions": "offset"},
        {"anchors": "elastic"},
        {"fringe": "none"},
        {"linear": True},
        {"undamped": True},
        {"scheme": "d1"},
        {"segments": 4},
        {"shear": True},
        {"rotary_inertia": True},
        {"formulation": "rcr"},
        {"imperfection": 1e-3},
        {"as_sugar": True},
        {"other_branch": True},
        {"without_circuit": True},
        {"ranges": "drive:0:1"},
    ]
    assert {name for other in others for name in other} == set(bimorph.Options.__annotations__)
    ids = {client.compile(NETLIST, **other).id for other in others}
    assert len(ids | {plain}) == len(others) + 1


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("tol", 1.0, "above 0, below 1"),
        ("band", -1.0, "above 0, at most 1e12 Hz"),
        ("segments", 0, "from 1 to 100000"),
        ("segments", 100_001, "from 1 to 100000"),
        ("junctions", "welded", '"centreline", "offset" or "calibrated"'),
        ("anchors", "glued", '"auto", "rigid" or "elastic"'),
        ("ranges", "drive:1:0", "LOW below HIGH"),
        ("fringe", "palmer", '"auto", "none", "parallel", "exact" or "sugar"'),
    ],
)
def test_ranges(client: bimorph.Client, name: str, value: Any, expected: str) -> None:
    """A value beyond its range is refused with the range."""
    with pytest.raises(bimorph.InvalidRequest, match=expected):
        client.compile(NETLIST, **{name: value})


def test_unknown_options_are_refused(client: bimorph.Client) -> None:
    """A keyword that is no option names those there are."""
    with pytest.raises(TypeError, match="rotary_inertia"):
        client.compile(NETLIST, tolerance=1e-3)  # type: ignore[call-arg]
