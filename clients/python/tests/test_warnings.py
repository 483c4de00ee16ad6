"""Warnings of accepted states of a session, on a server and in process."""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import Callable

import pytest
from conftest import PLATE

import bimorph
from bimorph import native

PLACES = pytest.mark.parametrize("place", ["server", "process"])


@pytest.fixture
def compiled(client: bimorph.Client, place: str) -> Callable[..., bimorph.Model]:
    """Compiles the plate with options, on a server or in this process."""

    def compile(**options: object) -> bimorph.Model:
        if place == "process" and native.found() is None:
            pytest.skip("the module for models in process is not installed")
        at = client if place == "server" else bimorph.local()
        return at.compile(bimorph.Netlist.text(PLATE, "plate.net"), **options)

    return compile


def codes(session: bimorph.Session) -> list[str]:
    return [one.code for one in session.warnings]


@PLACES
def test_a_session_has_the_warnings_of_its_states(compiled: Callable[..., bimorph.Model]) -> None:
    """A reduced model without ranges is replaced by the full one: the first accepted state warns of it with code, message and remedy, once."""
    with compiled(tol=1e-2, formulation="reduced").session(["m.x"]) as session:
        assert session.warnings == ()
        there = session.trial({"drive": 1.0})
        assert session.warnings == (), "a trial is no accepted state"
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            session.accept(there)
        (one,) = session.warnings
        assert (one.code, one.severity) == ("W053", "warning")
        assert "took the full model" in one.message and "ranges" in one.help
        for _ in range(3):
            session.step({"drive": 1.0}, 1e-7)
        session.run([1e-6, 2e-6], {"drive": 1.0})
        assert codes(session) == ["W053"]
        # those of another session are its own
        with session.fork() as other:
            other.step({"drive": 1.0}, 1e-7)
            assert codes(other) == ["W053"]
    assert codes(session) == ["W053"], "after its end, too"


@PLACES
def test_warnings_are_issued(compiled: Callable[..., bimorph.Model]) -> None:
    """Calls that accept a state issue the warnings that have come since: those of a run at its end, those of a step with the next call."""
    model = compiled(tol=1e-2, formulation="reduced")
    with model.session() as session, pytest.warns(bimorph.AccuracyWarning, match="^W053: .*the full model.*") as caught:
        session.run([1e-7, 2e-7], {"drive": 1.0})
    assert [warning.filename for warning in caught] == [__file__]
    with model.session() as session:
        session.operating_point({"drive": 1.0})
        with pytest.warns(bimorph.AccuracyWarning, match="^W053: ") as caught:
            session.step({"drive": 1.0}, 1e-7)
        assert [warning.filename for warning in caught] == [__file__]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            session.step({"drive": 1.0}, 1e-7)
    with bimorph.Batch.of([model, model]) as batch, pytest.warns(bimorph.AccuracyWarning) as caught:
        batch.run([1e-7, 2e-7], {"drive": 1.0})
    assert [str(warning.message)[:18] for warning in caught] == ["sessions[0]: W053:", "sessions[1]: W053:"]


@PLACES
def test_a_warning_that_is_an_error_leaves_the_state_accepted(compiled: Callable[..., bimorph.Model]) -> None:
    """With ``-W error`` a step whose call issues a warning is taken, and the session continues."""
    with compiled(tol=1e-2, formulation="reduced").session(["m.x"]) as session, warnings.catch_warnings():
        warnings.simplefilter("error", bimorph.AccuracyWarning)
        session.operating_point({"drive": 1.0})
        with pytest.raises(bimorph.AccuracyWarning):
            session.step({"drive": 1.0}, 1e-7)
        assert session.t == 1e-7
        session.step({"drive": 1.0}, 1e-7)
        assert session.t == 2e-7


@PLACES
def test_a_transient_along_inputs_has_them(compiled: Callable[..., bimorph.Model]) -> None:
    """The warnings of the states are among those of the result."""
    model = compiled(tol=1e-2, formulation="reduced")
    with pytest.warns(bimorph.AccuracyWarning):
        found = model.transient(1e-6, ["m.x"], points=11, inputs={"drive": ([0.0, 1e-6], [0.0, 1.0])})
    assert sum(one.startswith("W053: ") for one in found.warnings) == 1


@PLACES
def test_a_range_of_no_port_is_an_error(compiled: Callable[..., bimorph.Model]) -> None:
    """The error names the range and the ports."""
    with pytest.raises(bimorph.InvalidRequest, match=r'ranges: expected the name of a port of this model \(drive; .*got "gate:0e0:1e0"'):
        compiled(tol=1e-2, formulation="reduced", ranges="gate:0:1").session()


def test_warnings_for_asyncio(server: bimorph.Server) -> None:
    """The same as a coroutine."""

    async def main() -> list[str]:
        model = await bimorph.aio.Client(server.address).compile(bimorph.Netlist.text(PLATE, "plate.net"), tol=1e-2, formulation="reduced")
        async with await model.session() as session:
            await session.operating_point({"drive": 1.0})
            return [one.code for one in await session.warnings()]

    assert asyncio.run(main()) == ["W053"]
