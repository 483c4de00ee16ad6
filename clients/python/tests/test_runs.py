"""Many steps in one call: the bits of the same steps one by one, and errors that name the step."""

from __future__ import annotations

import contextlib
import importlib.util
import pickle
import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from conftest import PLATE

import bimorph

HERE = importlib.util.find_spec("bimorph._native") is not None


@pytest.fixture(params=["server", pytest.param("here", marks=pytest.mark.skipif(not HERE, reason="no models in process"))])
def model(request: pytest.FixtureRequest, plate: bimorph.Model) -> bimorph.Model:
    """The plate, on a server and in this process."""
    return plate if request.param == "server" else bimorph.local().compile(bimorph.Netlist.text(PLATE, "plate.net"))


def course(steps: int) -> tuple[Any, Any]:
    """Times and voltages with jumps beyond pull-in and long steps, so that the device needs pieces."""
    lengths = np.where(np.arange(steps) % 50 == 49, 1e-4, 2e-6)
    return np.cumsum(lengths), np.array([1.0, 5.5, 3.0, 0.0])[np.arange(steps) // 3 % 4]


def one_by_one(model: bimorph.Model, times: Any, volts: Any, start: float = 1.0) -> list[bimorph.TrialReply]:
    """The same steps by :meth:`Session.step`."""
    with model.session(["m.x", "m.vx"]) as session:
        session.operating_point({"drive": start})
        return [session.step({"drive": v}, dt) for v, dt in zip(volts, np.diff(times, prepend=0.0))]


def test_a_run_has_the_bits_of_its_steps(model: bimorph.Model) -> None:
    """Signals, currents, charges and the whole last reply; the session continues from there with the same bits. Signals may be left out."""
    times, volts = course(300)
    replies = one_by_one(model, times, volts)
    with model.session(["m.x", "m.vx"]) as session:
        session.operating_point({"drive": 1.0})
        run = session.run(times, {"drive": volts})
        assert run.t.tolist() == times.tolist()
        assert run.units == {"m.x": "m", "m.vx": "m/s"}
        for name in ("m.x", "m.vx"):
            assert run.signals[name].tolist() == [reply.outputs[name] for reply in replies]
        assert run.charges["drive"].tolist() == [reply.charges["drive"] for reply in replies]
        assert run.currents["drive"].tolist() == [reply.currents["drive"] for reply in replies]
        assert run.trials > 300, "no step was taken in pieces"
        assert session.accepted is not None
        last = replies[-1]
        assert (session.accepted.token, session.accepted.dq_dv) == (last.token, last.dq_dv)
        assert session.t == session.accepted.t == times[-1]
        after = session.step({"drive": 2.0}, 1e-6)
    with model.session(["m.x", "m.vx"]) as session:
        session.operating_point({"drive": 1.0})
        halves = [session.run(times[:100], {"drive": volts[:100]}, ["m.vx"]), session.run(times[100:], {"drive": volts[100:]}, ["m.vx"])]
        assert np.concatenate([half.signals["m.vx"] for half in halves]).tolist() == run.signals["m.vx"].tolist()
        assert list(halves[0].signals) == ["m.vx"]
        assert session.step({"drive": 2.0}, 1e-6) == after


def test_a_constant_voltage_and_parts(model: bimorph.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """A number holds for all times, ports that are not named keep theirs, and a run of several requests is the same."""
    times = 1e-6 * np.arange(1, 101)
    expected = [reply.outputs["m.x"] for reply in one_by_one(model, times, [2.0] * 100, 2.0)]
    monkeypatch.setattr("bimorph.runs._PART", 7)
    for voltages in ({"drive": 2.0}, {}, {"drive": np.full(100, 2.0)}):
        with model.session(["m.x"]) as session:
            session.operating_point({"drive": 2.0})
            assert session.run(times, voltages).signals["m.x"].tolist() == expected


def test_a_step_that_fails_names_itself(model: bimorph.Model) -> None:
    """A device that needs steps without end fails at that step: those before are there, the session stands after them, and continues. The
    error travels."""
    times, volts = 1e-6 * np.arange(1, 11), np.full(10, 2.0)
    # a jump of this size within 1 fs: pieces below a billionth of the step do not exist
    times[6:] += 1.0
    volts[6] = 1e12
    with model.session(["m.x"]) as session:
        session.operating_point({"drive": 2.0})
        with pytest.raises(bimorph.RunFailed, match=r"^step 6, to t = 1") as caught:
            session.run(times, {"drive": volts})
        error = caught.value
        assert (error.index, error.t, len(error.run)) == (6, times[6], 6)
        assert session.t == times[5]
        assert session.accepted is not None
        assert session.accepted.outputs["m.x"] == error.run.signals["m.x"][-1]
        session.run([session.t + 1e-6], {"drive": 2.0})
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.index, again.run.t.tolist()) == (str(error), 6, error.run.t.tolist())


@pytest.mark.parametrize(
    ("times", "voltages", "signals", "message"),
    [
        ([], {}, None, "times: expected a list of times"),
        (1e-6, {}, None, "times: expected a list of times"),
        ([[1e-6]], {}, None, "times: expected a list"),
        ([0.0, 1e-6], {}, None, r"times\[0\]: expected a time after that of the session, 0 s"),
        ([1e-6, 1e-6], {}, None, r"times\[1\]: expected ascending"),
        ([1e-6, float("nan")], {}, None, "times: expected finite"),
        (["a"], {}, None, "times: expected numbers"),
        (None, {}, None, "times: expected numbers"),
        ([1e-6], None, None, "voltages: expected names of ports"),
        ([1e-6], 3.0, None, "voltages: expected names of ports"),
        ([1e-6], {"drove": 1.0}, None, "voltages: no port named 'drove'"),
        ([1e-6], {"drive": None}, None, r"voltages\['drive'\]: expected numbers"),
        ([1e-6], {"drive": True}, None, r"voltages\['drive'\]: expected numbers"),
        ([1e-6], {"drive": "3"}, None, r"voltages\['drive'\]: expected numbers"),
        ([1e-6], {"drive": [1.0, 2.0]}, None, r"voltages\['drive'\]: expected a number, or one for each of 1 times"),
        ([1e-6], {"drive": float("inf")}, None, r"voltages\['drive'\]: expected finite"),
        ([1e-6], {"drive": [[1.0], [1.0, 2.0]]}, None, r"voltages\['drive'\]: expected numbers .in rows of equal length., got \[\[1.0\], \[1.0, 2.0\]\]"),
        ([1e-6], {"drive": np.ma.array([1.0], mask=[True])}, None, r"voltages\['drive'\]: expected numbers without masked values"),
        (np.ma.array([1e-6, 2e-6], mask=[False, True]), {}, None, "times: expected numbers without masked values"),
        ([[1e-6], [1e-6, 2e-6]], {}, None, "times: expected numbers .in rows"),
        ([1e-6], {3: 1.0}, None, "voltages: name of a port: expected a text"),
        ([1e-6], {}, "m.x", "signals: expected a list of names"),
        ([1e-6], {}, ["m.y"], r"signals\[0\]: 'm.y' is not among the signals of the session"),
        ([1e-6], {}, [3], r"signals\[0\]: expected a name"),
    ],
)
def test_what_does_not_fit_is_named(plate: bimorph.Model, times: Any, voltages: Any, signals: Any, message: str) -> None:
    """Each argument by its name, before anything is computed."""
    with plate.session(["m.x"]) as session:
        session.operating_point({"drive": 1.0})
        with pytest.raises(bimorph.InvalidRequest, match=message):
            session.run(times, voltages, signals)
        assert session.t == 0.0
        with pytest.raises(bimorph.InvalidRequest, match=message):
            bimorph.Batch([session]).run(times, voltages, signals)
        assert session.t == 0.0


@pytest.fixture
def interrupts() -> Iterator[None]:
    """SIGINT raises KeyboardInterrupt, also where the process that started the tests ignores it, as shells do for what runs in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def pressing_ctrl_c(*delays: float) -> Iterator[None]:
    """SIGINT after each of the delays (s), and then every second until the block is left: Python drops what is raised while it calls a finalizer."""
    left = threading.Event()

    def press() -> None:
        start = time.monotonic()
        for delay in delays:
            time.sleep(max(start + delay - time.monotonic(), 0.0))
            signal.raise_signal(signal.SIGINT)
        for _ in range(10):
            if left.wait(1.0):
                break
            signal.raise_signal(signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    try:
        yield
    finally:
        while thread.is_alive():
            with contextlib.suppress(KeyboardInterrupt):
                left.set()
                thread.join()


@pytest.mark.usefixtures("interrupts")
def test_ctrl_c_ends_a_run_and_leaves_the_session(model: bimorph.Model) -> None:
    """A run of minutes is over soon after Ctrl-C; the session stands where it stood, and has the bits of a quiet one."""
    times, volts = course(300)
    expected = [reply.outputs["m.x"] for reply in one_by_one(model, times, volts)]
    with model.session(["m.x"]) as session:
        session.operating_point({"drive": 1.0})
        long = 1e-7 * np.arange(1, 1_000_001)
        with pytest.raises(KeyboardInterrupt), pressing_ctrl_c(0.3):
            session.run(long, {"drive": 1.5})
        left = time.monotonic()
        assert session.t == 0.0
        assert session.run(times, {"drive": volts}).signals["m.x"].tolist() == expected
        assert time.monotonic() - left < 20.0


@pytest.mark.usefixtures("interrupts")
def test_interrupts_leave_the_connection_as_it_was(plate: bimorph.Model) -> None:
    """After each of ten interrupts of a run, with requests of 7 MB, other sessions of the same connection are opened and stepped."""
    long = 1e-7 * np.arange(1, 900_001)
    for k in range(10):
        with plate.session(["m.x"], timeout=10.0) as session:
            session.operating_point({"drive": 1.0})
            with pytest.raises(KeyboardInterrupt), pressing_ctrl_c(0.1 + 0.03 * k):
                for _ in range(100):
                    session.run(session.t + long, {"drive": 1.5})
    assert threading.active_count() < 40


def test_a_batch_has_the_bits_of_its_sessions(model: bimorph.Model) -> None:
    """Voltages for all, for each session, at each time; a session that fails stops alone."""
    times, volts = course(60)
    with bimorph.Batch.of([model] * 5, ["m.x"]) as batch:
        batch.operating_point({"drive": np.arange(5.0) / 2.0})
        own = volts + 0.1 * np.arange(5)[:, None]
        run = batch.run(times, {"drive": own})
        assert run.signals["m.x"].shape == run.charges["drive"].shape == (5, 60)
        assert not run.failures
        more = batch.step({"drive": np.arange(5.0)}, 1e-6)
        assert more.signals["m.x"].shape == (5, 1)
    for k in range(5):
        with model.session(["m.x"]) as session:
            session.operating_point({"drive": k / 2.0})
            alone = session.run(times, {"drive": own[k]})
            assert run.signals["m.x"][k].tolist() == alone.signals["m.x"].tolist()
            assert run.charges["drive"][k].tolist() == alone.charges["drive"].tolist()
            assert session.run([times[-1] + 1e-6], {"drive": float(k)}).signals["m.x"].tolist() == more.signals["m.x"][k].tolist()


def test_arrays_of_a_batch(model: bimorph.Model) -> None:
    """A batch of one takes a number, one for each time, and one row; of three sessions, three numbers of a run of two times are rejected with the
    shapes that fit. A single session takes no arrays for one number."""
    times, volts = [1e-6, 2e-6], [1.0, 3.0]
    with bimorph.Batch.of([model], ["m.x"]) as one:
        found = []
        for held, given in ((2.0, volts), ([2.0], [volts]), (np.array([2.0]), np.array([volts]))):
            one.operating_point({"drive": held})
            found.append(one.run(times, {"drive": given}).signals["m.x"].tolist())
        assert np.shape(found[0]) == (1, 2)
        # an equilibrium is followed from the accepted state: the same to rounding
        assert np.allclose(found[1], found[0], rtol=1e-9, atol=0.0) and np.allclose(found[2], found[0], rtol=1e-9, atol=0.0)
        assert one.step({"drive": [1.0]}, 1e-6).signals["m.x"].shape == (1, 1)
    with bimorph.Batch.of([model] * 3, ["m.x"]) as three:
        rows = three.run(times, {"drive": [[1.0], [2.0], [3.0]]}).signals["m.x"]
        assert rows.shape == (3, 2) and np.unique(rows[:, 1]).size == 3
        with pytest.raises(bimorph.InvalidRequest, match=r"voltages\['drive'\]: .*shape \(3, 1\) or \(3, 2\)\), got an array of shape \(3,\)"):
            three.run([3e-6, 4e-6], {"drive": [1.0, 2.0, 3.0]})
        with pytest.raises(bimorph.InvalidRequest, match=r"voltages\['drive'\]: expected a number, or one for each of 3 sessions, got an array of shape \(1,\)"):
            three.operating_point({"drive": [1.0]})
    with model.session(["m.x"]) as session:
        for call in (lambda: session.operating_point({"drive": [2.0]}), lambda: session.step({"drive": np.array([2.0])}, 1e-6)):
            with pytest.raises(bimorph.InvalidType, match=r"voltages\['drive'\]: expected a finite number, got "):
                call()


def test_an_operating_point_follows_the_accepted_state(model: bimorph.Model) -> None:
    """Raised to 3 V the plate is open; lowered to 3 V from 8 V it is closed, as pull-in is at 5.17 V; the time is 0 again."""
    with model.session(["m.x"]) as session:
        opened = session.operating_point({"drive": 3.0})
        session.step({}, 1e-6)
        closed = session.operating_point({"drive": 8.0})
        lowered = session.operating_point({"drive": 3.0})
        assert opened.outputs["m.x"] < 0.5e-6 < 1.9e-6 < lowered.outputs["m.x"] and closed.jumped
        assert session.t == 0.0


def test_a_session_of_a_batch_that_fails_stops_alone(model: bimorph.Model) -> None:
    """Its later values are NaN, and ``failures`` says where and why; the others go on."""
    times = np.array([1e-6, 2e-6, 1.0, 1.000001])
    volts = np.full((3, 4), 2.0)
    volts[1, 2] = 1e12
    with bimorph.Batch.of([model] * 3, ["m.x"]) as batch:
        batch.operating_point({"drive": 2.0})
        run = batch.run(times, {"drive": volts})
        assert list(run.failures) == [1]
        assert (run.failures[1].index, run.failures[1].t) == (2, 1.0)
        assert run.failures[1].reason
        assert np.isnan(run.signals["m.x"][1]).tolist() == [False, False, True, True]
        assert np.isfinite(run.signals["m.x"][[0, 2]]).all()
        with pytest.raises(bimorph.InvalidRequest, match="dt: expected sessions with one time, got 2e-06 s to 1 s"):
            batch.step({}, 1e-6)


def test_runs_are_shown_as_other_results(plate: bimorph.Model) -> None:
    """Runs of a session and of a batch are frames, labelled arrays, pictures and tables of a notebook, with units; a session that stopped says why."""
    times, volts = np.array([1e-6, 2e-6, 1.0]), np.full((3, 3), 2.0)
    volts[1, 2] = 1e12
    with plate.session(["m.x", "m.vx"]) as session, bimorph.Batch.of([plate] * 3, ["m.x", "m.vx"]) as batch:
        run, runs = session.run(times, {"drive": 2.0}), batch.run(times, {"drive": volts})
    assert "<th>m.vx [m/s]</th>" in run._repr_html_() and run._repr_html_().count("<tr>") == 4
    assert runs._repr_html_().count("<tr>") == 4 and runs.failures[1].reason.split()[0] in runs._repr_html_()
    pytest.importorskip("pandas")
    assert run.to_pandas().attrs["units"] == runs.to_pandas().attrs["units"] == {"t": "s", "m.x": "m", "m.vx": "m/s"}
    frame = runs.to_pandas()
    assert frame.index.names == ["session", "t"] and frame.shape == (9, 2)
    assert frame.loc[(2, 2e-6), "m.x"] == runs.signals["m.x"][2, 1] and np.isnan(frame.loc[(1, 1.0), "m.x"])
    pytest.importorskip("xarray")
    labelled, several = run.to_xarray(), runs.to_xarray()
    assert labelled["m.x"].values.tolist() == run.signals["m.x"].tolist() and labelled["m.vx"].attrs["units"] == "m/s"
    assert several["m.x"].dims == ("session", "t") and several.t.attrs["units"] == "s" and several["m.x"].attrs["units"] == "m"
    assert float(several["m.x"].sel(session=2, t=2e-6)) == runs.signals["m.x"][2, 1]
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    assert [line.get_ydata().tolist() for line in run.plot().get_lines()] == [values.tolist() for values in run.signals.values()]
    drawn = runs.plot()
    assert len(drawn.get_lines()) == 6 and drawn.get_xlabel() == "t [s]"
    assert [text.get_text() for text in drawn.get_legend().get_texts()] == ["m.x [m]", "m.vx [m/s]"]
    pyplot.close("all")


def states(batch: bimorph.Batch) -> list[tuple[float, int]]:
    """Time and name of the accepted state of each session."""
    return [(session.t, session.accepted.token if session.accepted else 0) for session in batch.sessions]


@pytest.mark.usefixtures("interrupts")
@pytest.mark.parametrize("part", [1 << 20, 300_000])
def test_an_interrupted_batch_keeps_every_state(model: bimorph.Model, monkeypatch: pytest.MonkeyPatch, part: int) -> None:
    """Ctrl-C in a run of a batch, whose lanes are at different steps, leaves every session in the state before, also where one request has few
    of the lanes, and where it is pressed twice. The next run has the bits of an undisturbed one."""
    times, volts = course(60)
    with bimorph.Batch.of([model] * 5, ["m.x"]) as batch:
        batch.operating_point({"drive": 1.0})
        expected = batch.run(times, {"drive": volts}).signals["m.x"].tolist()
    monkeypatch.setattr("bimorph.runs._PART", part)
    with bimorph.Batch.of([model] * 5, ["m.x"], timeout=20.0) as batch:
        batch.operating_point({"drive": 1.0})
        before = states(batch)
        long = 1e-7 * np.arange(1, 300_001)
        for delays in ((0.05,), (0.3,), (0.5, 0.5001)):
            with pytest.raises(KeyboardInterrupt), pressing_ctrl_c(*delays):
                batch.run(long, {"drive": 1.5})
            assert states(batch) == before
        assert batch.run(times, {"drive": volts}).signals["m.x"].tolist() == expected


@pytest.mark.usefixtures("interrupts")
def test_a_long_batch_stops_at_the_end_of_a_part(model: bimorph.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run of more port values of a session than one request takes goes in parts. After Ctrl-C all sessions have the state at the end of the same
    part, and the rest of the run has the bits of an undisturbed one."""
    times = 1e-7 * np.arange(1, 40_001)
    with bimorph.Batch.of([model] * 3, ["m.x"]) as batch:
        batch.operating_point({"drive": [1.0, 1.5, 2.0]})
        expected = batch.run(times, {}).signals["m.x"]
    monkeypatch.setattr("bimorph.runs._PART", 1000)
    with bimorph.Batch.of([model] * 3, ["m.x"], timeout=20.0) as batch:
        batch.operating_point({"drive": [1.0, 1.5, 2.0]})
        threading.Timer(0.15, signal.raise_signal, [signal.SIGINT]).start()
        with contextlib.suppress(KeyboardInterrupt):
            batch.run(times, {})
            time.sleep(0.5)
        done = round(float(batch.t[0]) / 1e-7)
        assert (batch.t == batch.t[0]).all() and done % 1000 == 0
        if done < len(times):
            assert batch.run(times[done:], {}).signals["m.x"].tolist() == expected[:, done:].tolist()


@pytest.mark.parametrize("workers", [1, 3])
def test_a_batch_that_fails_keeps_every_state(model: bimorph.Model, monkeypatch: pytest.MonkeyPatch, workers: int) -> None:
    """A session that is closed on the server, or here, ends a run, a step and an operating point of the batch; all sessions keep their states,
    those whose lanes had ended too."""
    monkeypatch.setattr("bimorph.batch.workers", lambda channel, lanes: workers)
    times, volts = course(60)
    with bimorph.Batch.of([model] * 5, ["m.x"]) as batch:
        batch.operating_point({"drive": np.arange(5.0)})
        batch.run(times, {"drive": volts})
        before = states(batch)
        lost = batch.sessions[3]
        model._channel.call("Close", bimorph.v1.device_pb2.CloseRequest(session=lost._session))
        with pytest.raises(bimorph.BimorphError):
            batch.run(times[-1] + times, {"drive": volts})
        assert states(batch) == before
        with pytest.raises(bimorph.BimorphError):
            batch.operating_point({"drive": 2.0})
        assert states(batch) == before
        lost.close()
        for call in (lambda: batch.run(times[-1] + times, {"drive": volts}), lambda: batch.step({}, 1e-6), lambda: batch.operating_point({"drive": 2.0})):
            with pytest.raises(bimorph.BimorphError, match="closed"):
                call()
            assert states(batch) == before
        for session in batch.sessions[:3]:
            session.step({"drive": 1.0}, 1e-6)


def test_a_batch_of_kept_sessions_is_accepted_as_a_whole(client: bimorph.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the third of five kept sessions cannot accept, those before accept their old states again: no session has moved, here or on the server."""
    model = client.compile(bimorph.Netlist.text(PLATE, "plate.net"))
    with contextlib.ExitStack() as stack:
        sessions = [stack.enter_context(model.session(["m.x"], kept=True)) for _ in range(5)]
        batch = bimorph.Batch(sessions)
        batch.operating_point({"drive": 1.0})
        asked: list[tuple[int, int]] = []
        for session in sessions:
            session.kept = True

        def report(self: bimorph.Session, reply: bimorph.TrialReply, *, warn: bool) -> None:
            asked.append((sessions.index(self), reply.token))
            if len(asked) == 3:
                raise bimorph.Unavailable("the third")

        before = states(batch)
        monkeypatch.setattr(bimorph.Session, "_report_accepted", report)
        with pytest.raises(bimorph.Unavailable, match="the third"):
            batch.run([1e-6, 2e-6], {"drive": 2.0})
        assert states(batch) == before
        assert [k for k, _ in asked] == [0, 1, 2, 0, 1, 2]
        assert [token for _, token in asked[3:]] == [token for _, token in before[:3]]
        monkeypatch.undo()
        for session in sessions:
            session.kept = False


def test_variants_are_a_batch(client: bimorph.Client) -> None:
    """Models of one netlist with other parameters: the softer spring moves further."""
    netlist = bimorph.Netlist.text(PLATE, "plate.net")
    models = [client.compile(netlist, set={"k": k}) for k in (1.0, 2.0, 4.0)]
    with bimorph.Batch.of(models, ["m.x"]) as batch:
        run = batch.run(1e-5 * np.arange(1, 5), {"drive": 2.0})
    assert (np.diff(np.abs(run.signals["m.x"][:, -1])) < 0.0).all()


def test_inputs_send_their_waveforms_once(plate: bimorph.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """A transient along inputs is one call, with the bits of steps one by one, and reports its progress."""
    calls: list[str] = []
    stream = bimorph.channel.Channel.stream

    def counted(self: Any, method: str, request: Any) -> Any:
        calls.append(method)
        return stream(self, method, request)

    monkeypatch.setattr(bimorph.channel.Channel, "stream", counted)
    wave = ([0.0, 1e-5, 3e-5], [0.0, 3.0, 1.0])
    seen: list[float] = []
    run = plate.transient(4e-5, ["m.x"], points=41, inputs={"drive": wave}, estimate=False, progress=seen.append)
    assert calls == ["Run"]
    assert seen
    assert seen[-1] == pytest.approx(1.0)
    output = np.linspace(0.0, 4e-5, 41)
    with plate.session(["m.x"]) as session:
        found = [session.operating_point({"drive": 0.0}).outputs["m.x"]]
        found += [session.step({"drive": float(np.interp(t, *wave))}, float(dt)).outputs["m.x"] for t, dt in zip(output[1:], np.diff(output))]
    assert run.signals["m.x"].tolist() == found
