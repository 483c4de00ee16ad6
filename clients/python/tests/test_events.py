"""Runs that end at an event, and what is reported of the time after a contact."""

from __future__ import annotations

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
