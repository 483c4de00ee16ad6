"""Runs that end at an event, and what is reported of the time after a contact."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import bimorph


def test_a_run_ends_at_its_event(plate: bimorph.Model) -> None:
    """At 8 V the plate closes: a run until contact ends there, one until a level ends before, and one that reaches neither says so."""
    whole = plate.transient(1e-4, ["m.x"], voltages={"drive": 8.0})
    assert whole.stopped_at is None
    closed = plate.transient(1e-4, ["m.x"], voltages={"drive": 8.0}, until="contact")
    assert closed.stopped_at is not None and closed.stopped_at < 1e-4
    assert closed.t[-1] <= closed.stopped_at < closed.t[-1] + 1e-7
    half = plate.transient(1e-4, ["m.x"], voltages={"drive": 8.0}, until=("m.x", 1e-6))
    assert half.stopped_at is not None and half.stopped_at < closed.stopped_at
    assert abs(half.signals["m.x"][-1] - 1e-6) < 0.1e-6
    with pytest.warns(bimorph.AccuracyWarning, match="does not reach"):
        open_ = plate.transient(1e-6, ["m.x"], voltages={"drive": 1.0}, until="contact")
    assert open_.stopped_at is None


def test_an_event_that_is_none_is_rejected(plate: bimorph.Model) -> None:
    """The argument is named, with what it may be."""
    for until in ["closing", ("m.x",), ("m.x", "1u"), 3]:
        with pytest.raises(bimorph.InvalidRequest, match="until: expected"):
            plate.transient(1e-4, ["m.x"], until=until)  # type: ignore[arg-type]


def test_crossings_are_reported(plate: bimorph.Model) -> None:
    """At 8 V the plate passes 0.5 and 1 µm on its way to contact: each crossing, and the contact, with its time and direction, in order. An unknown
    signal and what is no pair are rejected with the place in the list."""
    run = plate.transient(3e-5, ["m.x"], voltages={"drive": 8.0}, events=[("m.x", 1e-6), ("m.x", 0.5e-6)])
    first = [event for event in run.events if not event.contact][:2]
    assert [(event.signal, event.level, event.up) for event in first] == [("m.x", 0.5e-6, True), ("m.x", 1e-6, True)]
    for event in first:
        assert float(np.interp(event.t, run.t, run.signals["m.x"])) == pytest.approx(event.level, rel=1e-3)
    contact = next(event for event in run.events if event.contact)
    assert not contact.up and contact.t == plate.transient(3e-5, ["m.x"], voltages={"drive": 8.0}, until="contact").stopped_at
    assert [event.t for event in run.events] == sorted(event.t for event in run.events)
    with pytest.raises(bimorph.InvalidRequest, match=r"^events\[1\]: .*nosuch.x"):
        plate.transient(1e-6, ["m.x"], events=[("m.x", 1e-6), ("nosuch.x", 0.0)])
    for event in ("m.x", ("m.x",), ("m.x", None), (1.0, 2.0)):
        with pytest.raises(bimorph.InvalidRequest, match=r"^events\[0\]: expected a signal with the level"):
            plate.transient(1e-6, ["m.x"], events=[event])  # type: ignore[list-item]


@pytest.mark.parametrize("method", ["rodas4", "avf", "midpoint", "tr-bdf2", "generalized-alpha", "newmark", "radau5", "sdirk4"])
def test_integrators_agree(plate: bimorph.Model, method: str) -> None:
    """Equal steps of 0.1 µs, a six-hundredth of the period, give the motion of the default within 1 % of its amplitude."""
    expected = plate.transient(3e-5, ["m.x"], points=31, voltages={"drive": 2.0}).signals["m.x"]
    rho = 0.9 if method == "generalized-alpha" else None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bimorph.AccuracyWarning)
        run = plate.transient(3e-5, ["m.x"], points=31, voltages={"drive": 2.0}, method=method, rho=rho, step=1e-7)  # type: ignore[arg-type]
    assert run.steps == 300
    assert abs(run.signals["m.x"] - expected).max() < 0.01 * expected.max()


def test_rho_is_of_one_integrator(plate: bimorph.Model) -> None:
    """It is rejected by name with any other."""
    with pytest.raises(bimorph.InvalidRequest, match="^rho: expected None, as method is not"):
        plate.transient(1e-6, ["m.x"], rho=0.5)


def test_losses_of_stability_are_reported(plate: bimorph.Model) -> None:
    """On the way to 8 V the plate passes its pull-in at (8/27·k·g³/(ε·A))^½ = 5.1741 V; below there is none. The
    fraction is that of the voltage."""
    assert plate.static({"drive": 3.0}).passed == ()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bimorph.AccuracyWarning)
        found = plate.static({"drive": 8.0})
    assert [loss.kind for loss in found.passed] == ["limit-point"]
    assert found.passed[0].fraction == pytest.approx(5.1741 / 8.0, rel=1e-3)
    assert "limit-point at" in found._repr_html_()
