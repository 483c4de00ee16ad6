"""The bank of the demonstration: a heater pulse moves the yoke, and the comb's current says so."""

import numpy as np
import pytest
from conftest import ROOT

BANK = ROOT / "examples/bank/bank.net"


def deck(drive: str, analysis: str) -> str:
    return f"""bank
.model bank bimorph(file="{BANK}" ports=["heat" "sense"] monitors=["yoke.y:1e6" "b1.hot.T"])
A1 %gd [heat 0 comb 0] %v [y t] bank
Vheat heat 0 {drive}
Vbias comb 0 40
{analysis}
.end
"""


def test_operating_points(bench):
    """The yoke moves as the square of the voltage, since heat does; one hot arm of 2.06 kΩ and 30 W/(m·K) in a path of
    3.38 kΩ warms by V²·(2060/3381)²/(12·ρ·k) with ρ = 4e-5 Ω·m."""
    swept = bench.run(deck("0", ".dc Vheat 0 4 1"))
    rise, y = swept["t"] - swept["t"][0], swept["y"] - swept["y"][0]
    resistances = {"hot": 206 / 2, "bar": 23 / 13, "cold": 112 / 8, "flex": 94 / 1.9}
    total = 20 * sum(resistances.values()) + 5
    share = 20 * resistances["hot"] / total
    volts = np.arange(5.0)
    assert rise == pytest.approx((volts * share) ** 2 / (12 * 4e-5 * 30), rel=1e-6)
    assert y[1:] / y[1] == pytest.approx(volts[1:] ** 2, rel=2e-2)
    assert -5 < y[4] < -0.2, "the tips bend towards the cold arms, by a micrometre or so"


def test_pulse(bench):
    """A pulse of 300 µs warms the arms with ρ·c·l²/(π²·k) = 231 µs, and the yoke follows with its own ring."""
    run = bench.run(deck("PULSE(0 4 20u 1u 1u 300u 1m)", ".tran 1u 800u 0 1u"))
    t, warm, y = run["time"], run["t"] - run["t"][0], run["y"] - run["y"][0]
    at = lambda time, wave: np.interp(time, t, wave)
    tau = 2300 * 700 * (206e-6) ** 2 / (np.pi**2 * 30)
    steady = at(320e-6, warm) / (1 - np.exp(-299.5e-6 / tau))
    assert at(120e-6, warm) == pytest.approx(steady * (1 - np.exp(-99.5e-6 / tau)), rel=5e-3)
    assert at(320e-6, y) < -0.2
    assert abs(at(800e-6, y)) < 0.2 * abs(at(320e-6, y))
    assert np.argmin(y) == pytest.approx(np.searchsorted(t, 321e-6), abs=len(t) // 20)


def test_motional_current(bench):
    """The current of a comb at 40 V is 40·(N·ε·h/g)·velocity of its rotor: charge and motion tell the same story."""
    run = bench.run(
        deck("PULSE(0 4 20u 1u 1u 300u 1m)", ".tran 1u 400u 0 0.5u").replace('"yoke.y:1e6"', '"rotor.y:1e6"')
    )
    t, y = run["time"], run["y"] * 1e-6
    # A source's branch current flows from its plus node through the source.
    charge = np.concatenate([[0], np.cumsum(np.diff(t) * -(run["vbias#branch"][1:] + run["vbias#branch"][:-1]) / 2)])
    expected = 40 * 60 * 8.854e-12 * 2e-6 / 1e-6 * -(y - y[0])
    assert charge == pytest.approx(expected, abs=2e-2 * np.ptp(expected))
