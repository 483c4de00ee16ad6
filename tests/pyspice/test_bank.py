"""The bank of the demonstration: a heater pulse moves the yoke, and the comb's current says so."""

import pathlib

import numpy as np
import pytest

BANK = pathlib.Path(__file__).resolve().parents[2] / "examples/bank/bank.net"


def deck(drive: str, analysis: str) -> str:
    return f"""bank
.model bank bimorph(file="{BANK}" ports=["heat" "sense"] monitors=["yoke.y:1e6" "b1.hot.T"])
A1 %gd [heat 0 comb 0] %v [y t] bank
Vheat heat 0 {drive}
Vbias comb 0 40
.options reltol=1e-6
{analysis}
.end
"""


# Hot arm, bar, cold arm, flexure: length, width [m], sheet resistance [ohm], thermal conductivity [W/(m K)].
PATH = [(206e-6, 2e-6, 20, 30), (23e-6, 13e-6, 20, 30), (112e-6, 8e-6, 0.05, 107), (94e-6, 1.9e-6, 0.05, 107)]
TAU = 230e-6


def hot_arm_rise(volts: float) -> float:
    """Mean temperature rise of a hot arm by finite volumes along the path of current and heat from pad to pad."""
    cells = 400
    resistance = sum(sheet * length / width for length, width, sheet, _ in PATH) + 5
    current = volts / resistance
    half, heat = [], []  # thermal resistance of half a cell [K/W] and heat in a cell [W]
    for length, width, sheet, conductivity in PATH:
        half += [length / cells / 2 / (conductivity * width * 2e-6)] * cells
        heat += [current**2 * sheet * length / width / cells] * cells
    half = np.array(half)
    links = 1 / np.concatenate([half[:1], half[:-1] + half[1:], half[-1:]])  # pads at both ends
    matrix = np.diag(links[:-1] + links[1:]) - np.diag(links[1:-1], 1) - np.diag(links[1:-1], -1)
    return np.linalg.solve(matrix, heat)[:cells].mean()


def test_operating_points(bench):
    """The mean rise of a hot arm is that of steady conduction, and the yoke moves with it, as the square of the
    voltage; the rest of the motion is the square of the angle by which the arms turn."""
    swept = bench.run(deck("0", ".dc Vheat 0 2 0.5"))
    rise, y = swept["t"] - swept["t"][0], swept["y"] - swept["y"][0]
    volts = np.linspace(0, 2, 5)
    assert rise == pytest.approx((volts / 2) ** 2 * hot_arm_rise(2), rel=1e-4)
    assert y[1:] / y[1] == pytest.approx((volts[1:] / volts[1]) ** 2, rel=2e-2)
    assert -2 < y[4] < -0.5, "the tips bend towards the cold arms, by a micrometre or so"


def test_pulse(bench):
    """A pulse of 300 µs warms the arms with their time constant, and the yoke follows with its own ring."""
    run = bench.run(deck("PULSE(0 2 20u 1u 1u 300u 2m)", ".tran 1u 1.2m 0 1u"))
    t, warm, y = run["time"], run["t"] - run["t"][0], run["y"] - run["y"][0]

    def at(time, wave):
        return np.interp(time, t, wave)

    # Half of each ramp of 1 µs counts as on.
    assert at(121e-6, warm) == pytest.approx(hot_arm_rise(2) * (1 - np.exp(-100.5e-6 / TAU)), rel=2e-3)
    assert at(321e-6, warm) == pytest.approx(hot_arm_rise(2) * (1 - np.exp(-300.5e-6 / TAU)), rel=2e-3)
    assert at(322e-6, y) < -0.4
    assert t[np.argmin(y)] == pytest.approx(322e-6, abs=15e-6)
    assert abs(at(1.19e-3, y)) < 0.1 * abs(at(322e-6, y))


def test_motional_current(bench):
    """The charge of a comb at 40 V is 40·N·ε·h/g times its overlap, and 1/(1 − x²/g²) for its distance x from the middle of the gaps: charge and motion agree."""
    text = deck("PULSE(0 2 20u 1u 1u 300u 1m)", ".tran 1u 400u 0 0.5u")
    run = bench.run(text.replace('"yoke.y:1e6" "b1.hot.T"', '"rotor.y:1e6" "rotor.x:1e6"'))
    t, y, x = run["time"], run["y"] * 1e-6, run["t"] * 1e-6
    # A source's branch current flows from its plus node through the source.
    charge = np.concatenate([[0], np.cumsum(np.diff(t) * -(run["vbias#branch"][1:] + run["vbias#branch"][:-1]) / 2)])
    expected = 40 * 60 * 8.854e-12 * 2e-6 / 1e-6 * (8e-6 - y) / (1 - (x / 1e-6) ** 2)
    expected -= expected[0]
    assert charge == pytest.approx(expected, abs=2e-2 * np.ptp(expected))
