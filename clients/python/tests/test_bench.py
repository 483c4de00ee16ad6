"""What a test bench is written with: waveforms, tables, handles of sweeps, executors, ngspice, fixtures."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import PLATE

import bimorph
from bimorph import ngspice as spice
from bimorph.waveforms import drive

EPS, AREA, GAP, K = 8.854e-12, 1e-8, 2e-6, 1.0


def test_a_waveform_drives_a_run(plate: bimorph.Model) -> None:
    """A ramp that is slow against the resonance (16 kHz) keeps the equilibrium k·x = εAV²/2(g−x)²; corners are met, and the run along a
    constant input is the run with that voltage held, from its equilibrium."""
    t = [0.0, 2e-3, 3e-3]
    run = plate.transient(3e-3, ["m.x"], points=31, inputs={"drive": (t, [0.0, 3.0, 3.0])})
    assert run.t.shape == run.signals["m.x"].shape == (31,)
    x = run.signals["m.x"]
    volts = np.interp(run.t, t, [0.0, 3.0, 3.0])
    assert np.abs(K * x - EPS * AREA * volts**2 / (2 * (GAP - x) ** 2)).max() < 0.02 * K * x.max()
    assert x[0] == 0.0
    still = plate.transient(1e-4, ["m.x"], points=5, inputs={"drive": ([0.0], [2.0])}).signals["m.x"]
    assert np.ptp(still) <= 1e-9 * still[0]


def test_a_waveform_tells_how_far_it_is_off(client: bimorph.Client) -> None:
    """A clamped beam of one segment that is driven through its resonance: the run says that it is off by more than its tolerance, and one on
    32 segments that it is not. Without the comparison nothing is claimed."""
    net = (
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] [l=5u w=5u]\nbeam2d p [a b] [l=100u w=2u]\n"
        "anchor * [e] [l=1u w=1u h=1u]\ngap plategap2d * [b e] [A=1e-10 gap=2u oz=pi/2]\neground * [e] []\ndrive port * [b e] []"
    )
    waves = {"drive": ([0.0, 1e-6], [0.0, 5.0])}

    def run(segments: int, **more: bool) -> bimorph.TransientResult:
        model = client.compile(bimorph.Netlist.text(net), segments=segments)
        return model.transient(2e-5, ["b.y"], points=101, inputs=waves, **more)

    coarse, fine = run(1), run(32)
    error = float(np.sqrt(np.mean((coarse.signals["b.y"] - fine.signals["b.y"]) ** 2)) / np.ptp(fine.signals["b.y"]))
    assert coarse.estimated_error is not None and fine.estimated_error is not None
    assert error / 3 < coarse.estimated_error and coarse.estimated_error > 1e-3 and "estimated error of mesh and steps" in coarse.warnings[0]
    assert fine.estimated_error <= 1e-3 and not fine.warnings
    alone = run(1, estimate=False)
    assert alone.estimated_error is None and "no error estimate" in alone.warnings[0]


def test_waveforms_are_checked(plate: bimorph.Model) -> None:
    """Each fault of a waveform is reported with the port's name."""
    for wave, word in [(([0.0, 1.0], [1.0]), "as many"), (([0.0, 0.0], [1.0, 2.0]), "ascend"), (([0.0], [np.nan]), "finite")]:
        with pytest.raises(ValueError, match=f"'drive'.*{word}"):
            plate.transient(1e-5, ["m.x"], inputs={"drive": wave})
    masked = np.ma.array([1.0, 2.0], mask=[False, True])
    for wave, word in [(([0.0, 1.0], masked), "without masked"), (([[0.0], [0.0, 1.0]], [1.0, 2.0]), "lists of numbers"), (([0.0, 1.0], [1.0, np.inf]), "values, got inf at place 1")]:
        with pytest.raises(bimorph.InvalidRequest, match=f"^inputs: input 'drive'.*{word}"):
            plate.transient(1e-5, ["m.x"], inputs={"drive": wave})
    wave = {"drive": ([0.0, 1e-6], [0.0, 1.0])}
    for name, given in (("until", "contact"), ("until", ("m.x", 1e-9)), ("release", plate), ("tol", 1e-4)):
        with pytest.raises(bimorph.InvalidRequest, match=f"^{name}: expected none together with inputs, got "):
            plate.transient(1e-5, ["m.x"], inputs=wave, **{name: given})  # type: ignore[arg-type]
    with pytest.raises(bimorph.InvalidRequest, match="no port named 'drove'"):
        plate.transient(1e-5, ["m.x"], inputs={"drove": ([0.0], [1.0])})
    with pytest.raises(ValueError, match="stop: expected a time"):
        plate.transient(float("inf"), ["m.x"], inputs={"drive": ([0.0], [1.0])})


def test_an_edge_is_an_edge(plate: bimorph.Model) -> None:
    """However short it may be, and wherever it lies: after one of 2e-12 of the run the plate swings as after one of 1e-6 of it, whose corner
    is an output time or within rounding of one, also beside another port's edge. A shorter one is refused, with how long it must be."""
    stop = 1e-4

    def after(at: float, edge: float) -> list[float]:
        waves = {"drive": ([0.0, at, at + edge], [0.0, 0.0, 3.0]), "m.x": ([at - 0.7 * edge, at + 0.3 * edge], [0.0, 1e-8])}
        with plate.session(["m.x"], ports=["drive", "m.x"]) as session:
            return drive(session, waves, stop, 6).signals["m.x"].tolist()

    for at in (0.4e-4, 0.4e-4 * (1 - 3e-16), 0.4e-4 - 1e-16, 0.43e-4):
        slow = after(at, 1e-6 * stop)
        assert max(slow) > 1e-8
        # the speed of the plate is that of its resonance, 16 kHz: in a millionth of the run it goes 1e-5 of its way
        assert after(at, 2e-12 * stop) == pytest.approx(slow, rel=1e-3, abs=1e-4 * max(slow))
    for times in ([0.4e-4, 0.4e-4 + 5e-17], [-1e-20, 1e-20]):
        with pytest.raises(ValueError, match="'drive': an edge of .* must last at least 1e-16 s"):
            plate.transient(stop, ["m.x"], inputs={"drive": (times, [0.0, 3.0])})


def test_results_as_tables(plate: bimorph.Model) -> None:
    """Results show themselves in a notebook with units, and as pandas where that is installed."""
    run = plate.transient(1e-5, ["m.x"], points=50, voltages={"drive": 1.0})
    assert repr(run) == "<TransientResult of m.x [m]: 50 times to 1e-05 s>"
    assert run._repr_html_().count("<tr>") == 21 and "50 rows" in run._repr_html_()
    assert "frequency [Hz]" in plate.modes(1)._repr_html_() and "<td>m</td>" in plate.static()._repr_html_()
    pytest.importorskip("pandas")
    assert run.to_pandas().loc[0.0, "m.x"] == 0.0
    assert list(plate.modes(1).to_pandas().columns) == ["frequency_hz", "residual", "error"]
    pytest.importorskip("matplotlib").use("Agg")
    assert run.plot().get_xlabel() == "t [s]"


def test_a_sweep_goes_on_without_its_client(client: bimorph.Client) -> None:
    """A submitted sweep is found again by its id, has the table of a sweep that was waited for, and is gone once it was deleted."""
    netlist, axis = bimorph.Netlist.text(PLATE, "plate.net"), [1.0 + 0.01 * i for i in range(50)]
    whole = client.sweep(netlist, {"k": axis}, bimorph.Modes(count=1))
    started = client.submit(netlist, {"k": axis}, bimorph.Modes(count=1))
    found = client.attach(started.id)
    assert found.wait() == whole and found.status().state == "done" and found.status().points == 50
    found.delete()
    with pytest.raises(bimorph.NotFound):
        client.attach(started.id)
    assert repr(whole) == "<Table of f1 over k: 50 points>"


def test_shards_on_a_process_pool(client: bimorph.Client, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts that processes with servers of their own compute are the rows of one server; so are those of threads that share it."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    netlist, axis = bimorph.Netlist.text(PLATE, "plate.net"), [1.0 + 0.01 * i for i in range(23)]
    whole = client.sweep(netlist, {"k": axis}, bimorph.Modes(count=1))
    done: list[int] = []
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        parts = bimorph.sweep_on(
            pool, netlist, {"k": axis}, bimorph.Modes(count=1), shards=5, progress=lambda n, _: done.append(n)
        )
    assert parts == whole and done == [1, 2, 3, 4, 5]
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        assert bimorph.sweep_on(pool, netlist, {"k": axis}, bimorph.Modes(count=1), shards=4, server=client.address) == whole


@pytest.mark.skipif(sys.platform == "win32", reason="kills a process by signal")
def test_shards_on_dask_with_a_worker_killed(client: bimorph.Client, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three worker processes of a LocalCluster, one killed while parts are open: the rows of one server."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    monkeypatch.setenv("BIMORPH_BIN", program)
    netlist, axis = bimorph.Netlist.text(PLATE, "plate.net"), [1.0 + 0.01 * i for i in range(40)]
    whole = client.sweep(netlist, {"k": axis}, bimorph.Modes(count=1))
    killed: list[int] = []
    with (
        distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as dask,
    ):
        pids = list(dask.run(os.getpid).values())

        def kill(done: int, parts: int) -> None:
            if not killed and done < parts:
                killed.append(pids[0])
                os.kill(pids[0], signal.SIGKILL)

        parts = bimorph.sweep_on(dask, netlist, {"k": axis}, bimorph.Modes(count=1), shards=20, progress=kill)
        until = time.monotonic() + 20.0
        while pids[0] in dask.run(os.getpid, on_error="ignore").values() and time.monotonic() < until:
            time.sleep(0.1)
        assert pids[0] not in dask.run(os.getpid, on_error="ignore").values()
    assert parts == whole


def test_decks(program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A deck as text gives ngspice's waveforms: the plate where k·x = εAV²/2(g−x)² along a sweep; one that cannot run says why."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    if shutil.which("ngspice") is None:
        pytest.skip("ngspice is not installed")
    if not list(Path(program).parent.glob("*bimorph_ngspice*")):
        pytest.skip("the plug-in is not built")
    (tmp_path / "plate.net").write_text(PLATE)
    monkeypatch.chdir(tmp_path)
    deck = """* plate
V1 in 0 3
A1 %gd [in 0] %v [x] plate
.model plate bimorph(file="plate.net" ports=["drive"] monitors=["m.x:1e6"])
.dc V1 1 3 1
.end
"""
    run = spice.run(deck)
    assert run.plots[-1].name == "DC transfer characteristic"
    x = 1e-6 * run["v(x)"]
    volts = np.array([1.0, 2.0, 3.0])
    assert np.allclose(K * x, EPS * AREA * volts**2 / (2 * (GAP - x) ** 2), rtol=1e-5)
    with pytest.raises(bimorph.BimorphError, match="nosuch.net"):
        spice.run(deck.replace("plate.net", "nosuch.net"))
    # what a text includes is found from the working directory too
    (tmp_path / "source.inc").write_text("V1 in 0 3\n")
    included = spice.run(deck.replace("V1 in 0 3", ".include source.inc"))
    assert np.array_equal(included["v(x)"], run["v(x)"])


def test_fixtures(pytester: pytest.Pytester, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bench that uses the fixtures gets a server, a client and ngspice, without a line of set-up."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    pytester.makepyfile("""
        import bimorph
        def test_plate(bimorph_client, ngspice):
            text = "mass2d * [m] [m=1e-10]\\nanchor * [f] [l=1u w=1u h=1u]\\nspring2d * [f m] [kx=1]\\nguide2d * [m] []"
            model = bimorph_client.compile(bimorph.Netlist.text(text))
            assert model.modes(1).frequencies_hz[0] > 0
            assert callable(ngspice)
    """)
    result = pytester.runpytest_subprocess("-q")
    outcomes = result.parseoutcomes()
    assert outcomes.get("failed", 0) == 0 and outcomes.get("passed", 0) + outcomes.get("skipped", 0) == 1
