"""Driven anchors and nominal stresses against a real server. Numbers are closed forms of a clamped beam and of a mass on a spring."""

from __future__ import annotations

import math

import numpy as np
import pytest

import bimorph

LENGTH, WIDTH, MODULUS = 200e-6, 2e-6, 160e9
BEAM = """process p = [ Youngsmodulus=160e9 density=2330 h=2u strength=1e9 fillet=1u ]
anchor p [a] []
left beam2d p [a m] [l=100u w=2u]
right beam2d p [m b] [l=100u w=2u]
anchor p [b] [moves=1]
"""
SHAKER = """anchor   * [b] [l=1u w=1u h=1u moves=1]
spring2d * [b m] [kx=1 l=20u]
mass2d   * [m] [m=1e-10]
guide2d  * [m] []
"""


@pytest.fixture
def beam(client: bimorph.Client) -> bimorph.Model:
    """A beam between an anchor and a driven one, as Euler and Bernoulli have it."""
    return client.compile(bimorph.Netlist.text(BEAM, "beam.net"), junctions="centreline", segments=16)


@pytest.fixture
def shaker(client: bimorph.Client) -> bimorph.Model:
    """1e-10 kg on 1 N/m behind a driven anchor: ω₀ = 1e5 rad/s."""
    return client.compile(bimorph.Netlist.text(SHAKER, "shaker.net"))


def test_forces_and_nominal_stresses(beam: bimorph.Model) -> None:
    """A clamped end moved by v across needs the force 12EI·v/L³ and the moment −6EI·v/L²; a fillet raises the stress above the nominal one, M·w/(2I)."""
    v, inertia = 1e-10, WIDTH**4 / 12
    found = beam.static({"b.uy": v})
    force = found.anchor_forces["b"]
    assert force.fy == pytest.approx(12 * MODULUS * inertia * v / LENGTH**3, rel=1e-4)
    assert force.m == pytest.approx(-6 * MODULUS * inertia * v / LENGTH**2, rel=1e-4)
    bending = 6 * MODULUS * inertia * v / LENGTH**2 * WIDTH / 2 / inertia
    assert found.nominal_stresses_pa["left"] == pytest.approx(bending, rel=1e-4)
    assert found.stresses_pa["left"] > 1.1 * bending


def test_sessions_and_snapshots(beam: bimorph.Model) -> None:
    """Ports of an anchor take metres and radians and answer with newtons and newton metres; a restored session goes on with the same bits."""
    with beam.session(["m.y"], ["b.uy", "b.urz"]) as session:
        assert session.port_kinds == {"b.uy": "displacement", "b.urz": "rotation"}
        reply = session.operating_point({"b.uy": 1e-7, "b.urz": 1e-4})
        assert reply.currents["b.uy"] == beam.static({"b.uy": 1e-7, "b.urz": 1e-4}).anchor_forces["b"].fy
        snapshot = session.snapshot()
        ahead = session.step({"b.uy": 2e-7, "b.urz": 0.0}, 1e-7)
    with beam.restore(snapshot) as again:
        assert again.step({"b.uy": 2e-7, "b.urz": 0.0}, 1e-7).outputs == ahead.outputs


def test_responses_and_runs(shaker: bimorph.Model) -> None:
    """The transmissibility of a mass on a spring is 1/(1 − ω²/ω₀²). Behind a base that begins to move as u₀·(1 − cos ωt) the mass follows the closed form."""
    response = shaker.ac("b.ux", ["m.x", "b.fx"], start=1e3, stop=1e4, points=7, even=True)
    ratio = (2 * math.pi * response.frequencies_hz / 1e5) ** 2
    assert response.drive_unit == "m" and response.units["b.fx"] == "N/m"
    assert np.allclose(response.signals["m.x"], 1 / (1 - ratio), rtol=1e-5)
    assert np.allclose(response.signals["b.fx"], -ratio / (1 - ratio), rtol=1e-5)
    t, omega = np.linspace(0.0, 2e-4, 2001), 5e4
    run = shaker.transient(2e-4, ["m.x"], points=201, inputs={"b.ux": (t, 1e-6 * (1 - np.cos(omega * t)))})
    forced = 1 / (1 - (omega / 1e5) ** 2)
    exact = 1e-6 * (1 - forced * np.cos(omega * run.t) + (forced - 1) * np.cos(1e5 * run.t))
    assert np.abs(run.signals["m.x"] - exact).max() < 1e-3 * np.abs(exact).max()


def test_unknown_motions(beam: bimorph.Model) -> None:
    """An anchor without ``moves`` has no such input."""
    with pytest.raises(bimorph.InvalidRequest, match="moves=1"):
        beam.static({"a.uy": 1e-9})
