"""Steps are taken as a whole, and what is accepted is state and voltages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from conftest import PLATE
from test_kept import start

import bimorph

LONG = 2e-3
"""A plate that is pulled in within this time [s] needs more pieces than a session holds states."""


def counted(session: bimorph.Session, most: int | None = None) -> list[int]:
    """Counts the trials of a session; after so many it is interrupted."""
    count, ask = [0], session._line.ask

    def asked(request: Any) -> Any:
        if request.HasField("trial"):
            count[0] += 1
            if most is not None and count[0] > most:
                raise KeyboardInterrupt
        return ask(request)

    session._line.ask = asked  # type: ignore[method-assign]
    return count


def test_an_accepted_trial_brings_its_voltages(plate: bimorph.Model) -> None:
    """Ports that are not named keep what they had in the accepted state, which is what the trial was given, by default."""
    with plate.session(["m.x"], ports=["drive", "m.x"]) as session:
        there = session.trial({"drive": 2.0, "m.x": 1e-8})
        session.accept(there)
        assert there.outputs["m.x"] > 1e-8
        assert session.trial({}).outputs["m.x"] == pytest.approx(there.outputs["m.x"], rel=1e-9)
        assert session.snapshot().voltages == there.voltages == {"drive": 2.0, "m.x": 1e-8}
        session.accept(there, {"drive": 0.0})
        assert session.snapshot().voltages == {"drive": 0.0, "m.x": 1e-8}
        with pytest.raises(bimorph.InvalidRequest, match="nosuch"):
            session.accept(there, {"nosuch": 0.0})


def test_a_step_of_many_pieces_has_no_half(plate: bimorph.Model) -> None:
    """Interrupted at its first, second, eleventh or last but one trial: time, voltages and state are those before, and taken again it has
    the bits of a quiet session."""
    with plate.session(["m.x"]) as quiet:
        before = quiet.operating_point({"drive": 1.0})
        trials = counted(quiet)
        expected = quiet.step({"drive": 12.0}, LONG)
    assert trials[0] > 64, "more than a session holds states"
    for most in (0, 1, 10, trials[0] - 1):
        with plate.session(["m.x"]) as session:
            session.operating_point({"drive": 1.0})
            ask = session._line.ask
            counted(session, most)
            with pytest.raises(KeyboardInterrupt):
                session.step({"drive": 12.0}, LONG)
            session._line.ask = ask  # type: ignore[method-assign]
            assert (session.t, session.accepted) == (0.0, before)
            assert session.snapshot().voltages == {"drive": 1.0}
            assert session.step({"drive": 12.0}, LONG) == expected


def test_a_kept_step_of_many_pieces_has_no_half(program: str, tmp_path: Path) -> None:
    """The same of a session that outlives its server, which is killed in the middle of the step."""
    process = start(program, tmp_path, "--state-unsynced")
    try:
        model = bimorph.Client(f"unix://{tmp_path}/s").compile(bimorph.Netlist.text(PLATE))
        with model.session(["m.x"]) as quiet:
            quiet.operating_point({"drive": 1.0})
            trials = counted(quiet)
            expected = quiet.step({"drive": 12.0}, LONG)
        session = model.session(["m.x"], kept=True)
        session.operating_point({"drive": 1.0})
        counted(session, trials[0] - 1)
        with pytest.raises(KeyboardInterrupt):
            session.step({"drive": 12.0}, LONG)
        process.kill()
        process.wait()
        process = start(program, tmp_path, "--state-unsynced")
        session = session.resume()
        assert session.t == 0.0
        assert session.step({"drive": 12.0}, LONG) == expected
        session.close()
    finally:
        process.kill()
        process.wait()
