"""A plate on a spring in a circuit: k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², gap 2 µm."""

import numpy as np
import pytest

NETLIST = """
anchor  * [f] [l=1u w=1u h=1u]
mass2d  * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
damper2d * [f m] [bx=2e-6]
anchor  * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=2u]
eground * [e] []
drive port * [m] []
"""
AREA, GAP, EPSILON = 1e-8, 2e-6, 8.854e-12


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "plate.net"
    path.write_text(NETLIST)

    def of(source: str, analysis: str) -> str:
        return f"""plate
.model plate bimorph(file="{path}" ports=["drive"] monitors=["m.x:1e6"])
A1 %gd [drive 0] %v [x] plate
V1 drive 0 {source}
.options reltol=1e-6
{analysis}
.end
"""

    return of


def test_operating_points_balance_spring_and_field(bench, deck):
    """At every point below pull-in k·x = ε·A·V²/(2·(g − x)²)."""
    x = bench.run(deck("0", ".dc V1 0 5 0.5"))["x"] * 1e-6
    volts = np.linspace(0, 5, 11)
    force = EPSILON * AREA * volts**2 / (2 * (GAP - x) ** 2)
    assert x[1:] == pytest.approx(force[1:], rel=1e-5)


def test_small_signal_resonance_is_softened(bench, deck):
    """About 3 V the spring is softer by ε·A·V²/(g − x)³, and the admittance peaks where that says."""
    x0 = bench.run(deck("3", ".op"))["x"][0] * 1e-6
    softened = 1 - EPSILON * AREA * 9 / (GAP - x0) ** 3
    resonance = np.sqrt(softened / 1e-10) / (2 * np.pi)
    run = bench.run(deck("DC 3 AC 1", f".ac lin 401 {0.9 * resonance} {1.1 * resonance}"))
    moved = np.abs(run["x"])
    frequency = np.real(run["frequency"])
    # The peak of a damped resonator lies a little below: ω² = k/m − c²/(2·m²).
    peak = np.sqrt((2 * np.pi * resonance) ** 2 - 0.5 * (2e-6 / 1e-10) ** 2) / (2 * np.pi)
    assert frequency[np.argmax(moved)] == pytest.approx(peak, rel=1e-3)
