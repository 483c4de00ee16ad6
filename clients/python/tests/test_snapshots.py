"""A session continues from a snapshot or as a fork with the same bits."""

from __future__ import annotations

import pickle

import pytest
from conftest import PLATE

import bimorph


def test_a_snapshot_goes_on_elsewhere(program: str, plate: bimorph.Model) -> None:
    """At every step of a drive through pull-in, a session restored on another server takes the next step with the same bits."""
    with bimorph.serve(program) as server, plate.session(signals=["m.x"]) as session:
        elsewhere = server.client().compile(bimorph.Netlist.text(PLATE, "plate.net"))
        assert elsewhere.id == plate.id
        session.operating_point({"drive": 1.0})
        reach = []
        for k in range(12):
            snapshot = pickle.loads(pickle.dumps(session.snapshot()))
            voltages = {"drive": 1.0 + k}
            expected = session.step(voltages, dt=5e-6)
            with elsewhere.restore(snapshot) as moved:
                assert moved.step(voltages, dt=5e-6) == expected
                assert moved.t == session.t
            reach.append(session.read("m.x"))
        assert max(reach) > 2e-6 * 0.6, reach


def test_a_fork_goes_on_by_itself(plate: bimorph.Model) -> None:
    """Two ways on from one state do not see each other."""
    with plate.session(signals=["m.x"]) as session:
        session.operating_point({"drive": 1.0})
        with session.fork() as fork:
            there = fork.step({"drive": 3.0}, dt=1e-6)
            here = session.step({"drive": 2.0}, dt=1e-6)
            assert there.outputs["m.x"] > here.outputs["m.x"]
            assert fork.step({"drive": 3.0}, dt=1e-6).t == pytest.approx(2e-6)
        assert session.step({"drive": 2.0}, dt=1e-6).t == pytest.approx(2e-6)


def test_a_snapshot_of_another_model_is_refused(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Not read as something else."""
    other = client.compile(bimorph.Netlist.text(PLATE, "plate.net"), set={"k": 2.0})
    with plate.session() as session:
        session.operating_point({"drive": 1.0})
        snapshot = session.snapshot()
    with pytest.raises(bimorph.NoResult, match=plate.id):
        other.restore(snapshot)
