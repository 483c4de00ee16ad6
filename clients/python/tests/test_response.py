"""Frequency responses against a real server. Numbers are the textbook's lumped plate on a spring: k, m of conftest.PLATE."""

from __future__ import annotations

import math

import numpy as np
import pytest

import bimorph

K, M = 1.0, 1e-10


def test_a_mass_on_a_spring(plate: bimorph.Model) -> None:
    """1/(k − mω²) of an undamped mass for a force, its pole without damping, its value at rest; magnitude and phase as arrays."""
    result = plate.ac("m.fx", ["m.x", "m.vx"], start=1.0, stop=1e6, points=101)
    omega = 2 * math.pi * result.frequencies_hz
    exact = 1.0 / (K - M * omega**2)
    assert result.units == {"m.x": "m/N", "m.vx": "m/s/N"} and result.drive_unit == "N"
    assert isinstance(result.magnitude["m.x"], np.ndarray)
    assert np.allclose(result.signals["m.x"], exact, rtol=1e-9, atol=0.0)
    assert np.allclose(result.signals["m.vx"], 1j * omega * exact, rtol=1e-9, atol=0.0)
    assert np.allclose(result.magnitude["m.x"], np.abs(exact), rtol=1e-9) and result.phase["m.x"][0] == 0.0
    assert result.at_rest["m.x"] == pytest.approx(1 / K, rel=1e-12)
    assert result.poles is not None and [pole.quality for pole in result.poles] == [None]
    assert result.poles[0].frequency_hz == pytest.approx(math.sqrt(K / M) / (2 * math.pi), rel=1e-9)
    assert result.points_added == len(result.frequencies_hz) - 101
    assert result.estimated_error == 0.0


def test_a_port_under_bias(plate: bimorph.Model) -> None:
    """At rest a volt more at the port moves the plate by the slope of the static equilibrium; what is driven answers by itself."""
    result = plate.ac("drive", ["m.x", "drive.i"], start=10.0, stop=1e4, points=11, even=True, voltages={"drive": 2.0})
    step = 1e-4
    after, before = (plate.static({"drive": 2.0 + s}).nodes["m"].x for s in (step, -step))
    assert result.at_rest["m.x"] == pytest.approx((after - before) / (2 * step), rel=1e-6)
    assert len(result.frequencies_hz) == 11 and result.units["drive.i"] == "A/V"
    alone = plate.ac("drive", start=10.0, stop=1e4, points=11, even=True, voltages={"drive": 2.0})
    assert list(alone.signals) == ["drive.i"]
    assert np.array_equal(alone.signals["drive.i"], result.signals["drive.i"])


def test_modes_and_spacing(plate: bimorph.Model) -> None:
    """One mode is all there is, so that its sum is exact; grids are even in the requested way."""
    kept = plate.ac("m.fx", start=1.0, stop=100.0, points=10, spacing="linear", even=True, by_modes=True)
    assert kept.modes == 1 and kept.modal_error is not None and kept.modal_error < 1e-9
    assert np.allclose(np.diff(kept.frequencies_hz), 11.0)
    decade = plate.ac("m.fx", start=1.0, stop=100.0, points=10, spacing="decade", even=True)
    assert len(decade.frequencies_hz) == 21 and decade.modes is None


def test_refusals(plate: bimorph.Model) -> None:
    """What means nothing, and what is too much, is refused by name, whatever its size."""
    for what, drive, keywords in [
        ("start", "m.fx", {"start": 0.0, "stop": 1.0}),
        ("start", "m.fx", {"start": math.nan, "stop": 1.0}),
        ("stop", "m.fx", {"start": 1.0, "stop": 1e300}),
        ("stop", "m.fx", {"start": 2.0, "stop": 1.0}),
        ("points", "m.fx", {"start": 1.0, "stop": 2.0, "points": 2_000_000_000}),
        ("drive", "absent.fx", {"start": 1.0, "stop": 2.0}),
        ("signal", "m.fx", {"signals": ["absent.x"], "start": 1.0, "stop": 2.0}),
    ]:
        with pytest.raises(bimorph.InvalidRequest, match=what):
            plate.ac(drive, **keywords)  # type: ignore[arg-type]
    with pytest.raises(bimorph.InvalidRequest, match="spacing"):
        plate.ac("m.fx", start=1.0, stop=2.0, spacing="odd")  # type: ignore[arg-type]
    with pytest.raises(bimorph.LimitExceeded, match="message_bytes"):
        plate.ac("m.fx", ["m.x"] * 40, start=1.0, stop=2.0, points=1_000_000)
    with pytest.raises(bimorph.LimitExceeded, match="signals"):
        plate.ac("m.fx", ["m.x"] * 20_000, start=1.0, stop=2.0)
