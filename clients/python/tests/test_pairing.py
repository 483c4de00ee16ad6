"""Every call of a session gets its own answer: after interrupted calls, and from many threads."""

from __future__ import annotations

import random
import signal
import threading
from typing import Any

import pytest

import bimorph


class Interrupted(Exception):
    """What a test runner's time-out raises in the middle of a call."""


def answers(session: bimorph.Session, voltages: list[float]) -> list[float]:
    """Charge at each voltage: different for each, so that a swapped answer shows."""
    return [session.trial({"drive": v}).charges["drive"] for v in voltages]


def test_interrupted_calls_leave_no_answer_behind(plate: bimorph.Model) -> None:
    """Forty calls, each interrupted at some moment; the call after each has the bits that a quiet session gives."""
    voltages = [0.5 + 0.01 * k for k in range(40)]
    with plate.session() as quiet:
        expected = answers(quiet, voltages)

    def interrupt(*_: object) -> None:
        raise Interrupted

    before = signal.signal(signal.SIGALRM, interrupt)
    chance = random.Random(1)
    interrupted = 0
    try:
        with plate.session() as session:
            for voltage, charge in zip(voltages, expected):
                try:
                    # some of these end before the alarm, some in the middle; the longest is stopped for certain
                    # (Python drops what is raised while it calls a finalizer: then the next alarm does it)
                    signal.setitimer(signal.ITIMER_REAL, chance.uniform(5e-5, 2e-3), 0.5)
                    while True:
                        session.trial({"drive": 3.0 - voltage})
                except Interrupted:
                    interrupted += 1
                finally:
                    signal.setitimer(signal.ITIMER_REAL, 0)
                assert session.trial({"drive": voltage}).charges["drive"] == charge
    finally:
        signal.signal(signal.SIGALRM, before)
    assert interrupted == 40


@pytest.mark.parametrize("moment", ["before", "after"])
def test_an_interrupted_step_leaves_the_accepted_state(plate: bimorph.Model, moment: str) -> None:
    """Whether or not its question was sent, a step has no half, and taken again it has the bits of a quiet session."""
    with plate.session(signals=["m.x"]) as quiet:
        quiet.operating_point({"drive": 1.0})
        expected = quiet.step({"drive": 2.0}, dt=1e-6)
    with plate.session(signals=["m.x"]) as session:
        session.operating_point({"drive": 1.0})
        ask = session._line.ask

        def interrupt(request: Any) -> Any:
            if moment == "after":
                ask(request)
            raise KeyboardInterrupt

        session._line.ask = interrupt  # type: ignore[method-assign]
        with pytest.raises(KeyboardInterrupt):
            session.step({"drive": 2.0}, dt=1e-6)
        session._line.ask = ask  # type: ignore[method-assign]
        assert session.t == 0.0 and session.accepted is not None and session.accepted.t == 0.0
        assert session.step({"drive": 2.0}, dt=1e-6) == expected


def test_threads_share_a_session(plate: bimorph.Model) -> None:
    """Two threads, five hundred trials each at voltages of their own: every answer is that of its question."""
    series = [[0.5 + 0.001 * k for k in range(500)], [2.5 - 0.001 * k for k in range(500)]]
    with plate.session() as quiet:
        expected = [answers(quiet, voltages) for voltages in series]
    found: list[list[float]] = [[], []]
    with plate.session() as session:

        def run(which: int) -> None:
            found[which] = answers(session, series[which])

        threads = [threading.Thread(target=run, args=(which,)) for which in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert found == expected


def test_a_closed_session_says_so(plate: bimorph.Model) -> None:
    """Not a time-out, and not an old answer."""
    session = plate.session()
    session.close()
    with pytest.raises(bimorph.BimorphError, match="closed"):
        session.trial({"drive": 1.0})
