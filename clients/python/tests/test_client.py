"""The client against a real server. Reference numbers are the textbook's lumped plate: k, m, A, gap of conftest.PLATE."""

from __future__ import annotations

import math
import multiprocessing
import os
import pickle
import sys
import threading
import time
import warnings
from pathlib import Path

import pytest
from conftest import PLATE

import bimorph

EPS0 = 8.854e-12
K, M, A, GAP = 1.0, 1e-10, 1e-8, 2e-6
PULL_IN = math.sqrt(8 * K * GAP**3 / (27 * EPS0 * A))


def closed_form(v: float) -> float:
    """Displacement toward the fixed plate [m] where k x = ε A v² / 2 (g − x)², by bisection."""
    low, high = 0.0, GAP / 3
    for _ in range(200):
        x = (low + high) / 2
        low, high = (x, high) if K * x < EPS0 * A * v * v / (2 * (GAP - x) ** 2) else (low, x)
    return low


def test_a_model_describes_itself(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Ports, nodes and parameters come back by name, and the same text has the same id."""
    assert plate.ports == ("drive",)
    assert "m" in plate.nodes
    assert plate.parameters == {"V": 0.0, "k": 1.0}
    assert client.compile(bimorph.Netlist.text(PLATE, "plate.net")).id == plate.id
    assert client.compile(bimorph.Netlist.text(PLATE, "plate.net"), set={"k": 2}).parameters["k"] == 2.0


def test_static_follows_the_closed_form(plate: bimorph.Model) -> None:
    """Equilibrium at 2 V, and the charge on the plates there."""
    result = plate.static({"drive": 2.0})
    x = closed_form(2.0)
    assert result.nodes["m"].x == pytest.approx(x, rel=1e-6)
    assert abs(result.charges_c["drive"]) == pytest.approx(EPS0 * A / (GAP - x) * 2.0, rel=1e-6)
    assert not result.pulled_in


def test_modes_and_pull_in(plate: bimorph.Model) -> None:
    """f = √(k/m) / 2π, and V = √(8 k g³ / 27 ε A)."""
    assert plate.modes(count=1).frequencies_hz[0] == pytest.approx(math.sqrt(K / M) / (2 * math.pi), rel=1e-9)
    result = plate.pull_in(max_v=2 * PULL_IN)
    assert result.pull_in_v == pytest.approx(PULL_IN, rel=1e-3)


def test_losses_of_modes(client: bimorph.Client) -> None:
    """Plates of 100 µm × 100 µm over 4 µm in air, 4 N/m, 1e-9 kg: 1/Q = c/(m·ω₀), c = 1.111e-5 N·s/m by hand from 0.421731·μ·l⁴/(Q·g³), all of it by gas.

    In vacuum under 2 V through 1 MΩ all of it is electrical, η²·R/(ω·m) with η = V·C/g at the equilibrium (Tilmans 1996), within 1 % where u is left out."""
    text = """
        process air = [ viscosity=1.83e-5 pressure=101325 ]
        anchor * [f] []
        spring2d * [f a] [kx=4]
        mass2d * [a] [m=1e-9]
        guide2d * [a] []
        anchor * [b] []
        plategap2d air [a b] [l=100u w=100u gap=4u fringe=none]"""
    model = client.compile(bimorph.Netlist.text(text))
    assert model.modes(1).losses == ()
    (loss,) = model.modes(1, quality=True).losses
    assert loss.gas == pytest.approx(1.111e-5 / (1e-9 * math.sqrt(4 / 1e-9)), rel=1e-3)
    assert loss.drag == loss.thermoelastic == 0.0 and loss.quality == pytest.approx(1 / loss.gas)
    assert loss.electrical == loss.anchors == 0.0
    wired = text.replace("air [a b]", "* [a b]") + """
        R * [s b] [R=1e6]
        eground * [a] []
        drive port * [s] []"""
    (loss,) = client.compile(bimorph.Netlist.text(wired)).modes(1, {"drive": 2.0}, quality=True).losses
    capacitance = 8.854e-12 * 1e-8 / 4e-6
    assert loss.electrical == pytest.approx((2.0 * capacitance / 4e-6) ** 2 * 1e6 / (math.sqrt(4 / 1e-9) * 1e-9), rel=1e-2)
    assert loss.gas == 0.0 and loss.quality == pytest.approx(1 / loss.electrical)


def test_transient_streams_its_samples(plate: bimorph.Model) -> None:
    """Held at 1 V from rest, the plate swings about its equilibrium; progress never goes back, and the result has the choice of a formulation."""
    seen: list[float] = []
    result = plate.transient(5e-5, ["m.x"], points=51, voltages={"drive": 1.0}, progress=seen.append)
    assert len(result.t) == len(result.signals["m.x"]) == 51
    assert result.units == {"m.x": "m"}
    assert result.t[-1] == pytest.approx(5e-5)
    assert max(result.signals["m.x"]) > closed_form(1.0)
    assert seen == sorted(seen) and seen[-1] == 1.0
    assert result.step_error is not None and 0 < result.step_error < 1e-3
    assert result.formulation_taken is not None and result.formulation_taken.startswith("compliant: ")
    assert result.warnings == ()


def test_what_is_beyond_is_said_aloud(client: bimorph.Client) -> None:
    """Results and meshes beyond their tolerance and netlists that may not be meant come as warnings of Python; what holds says nothing."""
    beam = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=200u w=2u]\n"
    net = beam + "f2d * [b] [F=10u oz=pi/2]\ndrive port * [b a] []\n"
    with pytest.warns(bimorph.NetlistWarning, match="W012"):
        client.compile(bimorph.Netlist.text(net + "anchor p [c] []\nbeam2d p [d e] [l=200u w=2u]\nbeam2d p [c f] [l=9u w=2u]\n"))
    coarse = client.compile(bimorph.Netlist.text(net), segments=1)
    with pytest.warns(bimorph.AccuracyWarning, match="estimated error") as caught:
        coarse.static()
    assert caught[0].filename == __file__
    with pytest.warns(bimorph.AccuracyWarning, match="estimated error") as caught:
        coarse.session().close()
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error", bimorph.AccuracyWarning)
        fine = client.compile(bimorph.Netlist.text(net))
        fine.static()
        fine.session().close()
        assert fine.unknowns > coarse.unknowns


def test_what_the_numbers_do_not_say_arrives(client: bimorph.Client) -> None:
    """A linear cantilever under half of Euler's load says what stress would do; a closed gap, where it snaps further."""
    silicon = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\n"
    pressed = "beam2d p [a b] [l=200u w=2u]\nf2d * [b] [F=6.8u oz=pi]\nf2d * [b] [F=1n oz=pi/2]\n"
    model = client.compile(bimorph.Netlist("pressed.net", {"pressed.net": silicon + pressed}), linear=True)
    (warning,) = model.static().warnings
    assert "stress" in warning
    assert not model.static().jumped
    facing = """beam2d p [a b] [l=200u w=2u]
        gap2dforce p [a b c d] [l=200u w1=2u w2=2u gap=2u]
        R * [a b] [R=1]
        R * [c d] [R=1]
        anchor p [c] []
        anchor p [d] []
        eground * [a] []
        drive port * [c a] []
        """
    found = client.compile(bimorph.Netlist("gap.net", {"gap.net": silicon + facing})).pull_in(max_v=200.0)
    assert found.held and found.estimated_error is not None and found.estimated_error <= 1e-3
    assert any("snaps further" in warning for warning in found.warnings)


def test_a_session_steps_and_reads(plate: bimorph.Model) -> None:
    """A trial leaves no trace and repeats to the bit; a step moves the time; motion is read by node."""
    with plate.session(signals=["m.x", "m.y", "m.rz"]) as session:
        first = session.operating_point({"drive": 1.0})
        assert session.motion("m").x == pytest.approx(closed_form(1.0), rel=1e-6)
        assert session.signals["m.rz"] == "rad"
        tried = session.trial({"drive": 1.5}, dt=1e-7)
        session.trial({"drive": 0.3}, dt=2e-7)
        assert session.trial({"drive": 1.5}, dt=1e-7) == tried
        assert session.accepted == first
        reply = session.step({"drive": 1.5}, dt=1e-6)
        assert session.t == pytest.approx(1e-6)
        assert reply.outputs["m.x"] > first.outputs["m.x"]
        assert session.read("m.x") == reply.outputs["m.x"]
        assert reply.dq_dv["drive"]["drive"] > 0


def test_a_session_holds_still_at_equilibrium(plate: bimorph.Model) -> None:
    """Steps at the voltage of the operating point do not move the plate."""
    with plate.session(signals=["m.x"]) as session:
        start = session.operating_point({"drive": 2.0}).outputs["m.x"]
        for _ in range(20):
            session.step({}, dt=1e-6)
        assert session.read("m.x") == pytest.approx(start, rel=1e-6)


def test_small_signals(plate: bimorph.Model) -> None:
    """Far below resonance the admittance is jω dQ/dV of the static curve."""
    with plate.session() as session:
        session.operating_point({"drive": 1.0})
        omega, h = 10.0, 1e-4
        charge = [plate.static({"drive": v}).charges_c["drive"] for v in (1 - h, 1 + h)]
        y = session.linearize(omega)["drive"]["drive"]
        assert abs(y.imag) == pytest.approx(omega * abs(charge[1] - charge[0]) / (2 * h), rel=1e-5)


MASS = """
anchor * [g] [l=1u w=1u h=1u]
mass2d * [m] [m=1e-10 J=1e-20]
spring2d * [g m] [kx=4 ky=1e3 krz=1]
damper2d * [g m] [bx=5e-7]
"""


def test_noise(client: bimorph.Client) -> None:
    """A damped mass moves by 4·k_B·T·c·|χ|² (Callen and Welton 1951); 27 °C where the netlist names no temperature."""
    m, c, k = 1e-10, 5e-7, 4.0
    model = client.compile(bimorph.Netlist.text(MASS, "mass.net"))
    with model.session(ports=["m.x"], signals=["m.vx"]) as session:
        session.operating_point({})
        for omega in (1e3, 2e5):
            noise = session.noise(omega)
            want = 4 * 1.380649e-23 * 300.15 * c / ((k - m * omega**2) ** 2 + (omega * c) ** 2)
            assert noise["m.x"]["m.x"] == pytest.approx(want, rel=1e-9, abs=0)
            assert noise["m.vx"]["m.x"] == pytest.approx(1j * omega * want, rel=1e-9, abs=0)


def test_agitation(client: bimorph.Client) -> None:
    """A seed decides how warm gas shakes a mechanism; without one it stands still."""
    model = client.compile(bimorph.Netlist.text(MASS, "mass.net"))

    def motion(seed: int | None) -> list[float]:
        with model.session(signals=["m.x"], seed=seed, noise_band=None if seed is None else 1e6) as session:
            session.operating_point({})
            return [session.step({}, dt=4e-7).outputs["m.x"] for _ in range(30)]

    still, one, other = motion(None), motion(1), motion(2)
    assert max(map(abs, still)) < 1e-18
    assert motion(1) == one
    assert one != other
    with pytest.raises(ValueError, match="seed"):
        model.session(noise_band=1e6)


def test_sweeps(client: bimorph.Client) -> None:
    """A grid comes back in order; shards put together are the whole; a failed point has a reason and no number."""
    netlist = bimorph.Netlist.text(PLATE, "plate.net")
    axis = [0.5, 1.0, 2.0, 4.0]
    done: list[int] = []
    whole = client.sweep(netlist, {"k": axis}, bimorph.Modes(count=1), progress=lambda n, _: done.append(n))
    expected = [math.sqrt(k / M) / (2 * math.pi) for k in axis]
    assert whole.column("f1") == pytest.approx(expected, rel=1e-9)
    assert whole.units == {"f1": "Hz"} and done[-1] == 4
    parts = [client.sweep(netlist, {"k": axis}, bimorph.Modes(count=1), shard=(i, 3)) for i in range(3)]
    rows = sorted((row for part in parts for row in part.rows), key=lambda row: row.point)
    assert rows == whole.rows
    with pytest.raises(bimorph.NoResult, match="none of the 1 points.*point 0: ") as caught:
        client.sweep(netlist, {"k": [1.0]}, bimorph.PullIn(max_v=PULL_IN / 2))
    failed = pickle.loads(pickle.dumps(caught.value)).table
    assert failed.rows[0].error and failed.rows[0].results == {}
    assert failed.to_csv().startswith("point,k,")


def test_includes_are_sent(client: bimorph.Client, tmp_path: Path) -> None:
    """A netlist is read with the files it uses, which the server never opens."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "spring.net").write_text("spring2d * [f m] [kx=4]\n")
    text = "".join(line for line in PLATE.splitlines(keepends=True) if not line.startswith("spring2d"))
    (tmp_path / "top.net").write_text(text + "uses parts/spring.net\n")
    model = client.compile(tmp_path / "top.net")
    assert model.modes(count=1).frequencies_hz[0] == pytest.approx(math.sqrt(4 / M) / (2 * math.pi), rel=1e-9)


def test_bad_netlists(client: bimorph.Client) -> None:
    """Errors come with place, as data and as text."""
    with pytest.raises(bimorph.NetlistError) as caught:
        client.compile(bimorph.Netlist.text(PLATE + "nosuch * [m] []\n", "bad.net"))
    places = [(d.file, d.line) for d in caught.value.diagnostics if d.severity == "error"]
    assert ("bad.net", 11) in places
    assert any(v.field.startswith("bad.net:11:") for v in caught.value.violations)
    assert "nosuch" in str(caught.value)


def test_other_refusals(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Unknown names, states and servers each have their error."""
    with pytest.raises(bimorph.InvalidRequest, match="nosuch"):
        plate.session(signals=["nosuch.x"])
    with plate.session() as session, pytest.raises(bimorph.InvalidRequest, match="drive"):
        session.trial({"nosuch": 1.0})
    with pytest.raises(bimorph.InvalidRequest, match="stop: expected a time"):
        plate.transient(-1.0, ["m.x"])
    with pytest.raises(bimorph.NoResult):
        plate.pull_in(max_v=PULL_IN / 2)
    with pytest.raises(bimorph.Unavailable, match="nonexistent"):
        bimorph.Client("unix:///nonexistent/s", timeout=5).version()


def _version(client: bimorph.Client, answers: "multiprocessing.SimpleQueue[str]") -> None:
    answers.put(client.version())


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_client_survives_into_child_processes(client: bimorph.Client, method: str) -> None:
    """A used client works in a forked and in a spawned child: the channel is made anew there."""
    version = client.version()
    context = multiprocessing.get_context(method)
    answers = context.SimpleQueue()
    child = context.Process(target=_version, args=(client, answers))
    child.start()
    child.join(60)
    assert child.exitcode == 0
    assert answers.get() == version == client.version()


def test_clients_travel(client: bimorph.Client) -> None:
    """A client can be sent to a worker."""
    assert pickle.loads(pickle.dumps(client)).address == client.address


def test_serve_stops_what_it_started(program: str) -> None:
    """At the end of the block the process is gone, and its socket with it."""
    with bimorph.serve(program) as server:
        path = server.address.removeprefix("unix://")
        assert server.client().version()
        assert os.path.exists(path)
    assert server.process.poll() is not None
    assert not os.path.exists(path)


def test_serve_says_why_it_does_not_start(tmp_path: Path) -> None:
    """A missing program, and one that is something else."""
    with pytest.raises(bimorph.Unavailable, match="nosuch"), bimorph.serve(str(tmp_path / "nosuch")):
        pass
    with pytest.raises(bimorph.Unavailable, match="did not start"), bimorph.serve("/bin/false"):
        pass


def test_ports_take_forces_and_accelerations(plate: bimorph.Model) -> None:
    """x = (F − m·a)/k, and ∂x/∂F = 1/k, ∂x/∂a = −m/k; a force and a voltage move the plate together."""
    with plate.session(ports=["m.x", "frame.ax", "drive"]) as session:
        assert session.port_kinds == {"m.x": "force", "frame.ax": "acceleration", "drive": "electrical"}
        reply = session.operating_point({"m.x": 1e-8, "frame.ax": 40.0})
        assert reply.currents["m.x"] == pytest.approx((1e-8 - M * 40.0) / K, rel=1e-9)
        assert reply.di_dv["m.x"]["m.x"] == pytest.approx(1 / K, rel=1e-9)
        assert reply.di_dv["m.x"]["frame.ax"] == pytest.approx(-M / K, rel=1e-9)
        assert reply.currents["frame.ax"] == reply.charges["m.x"] == 0.0
        # what the force moves the charge by, the voltage moves the plate by
        biased = session.operating_point({"drive": 2.0, "m.x": 0.0, "frame.ax": 0.0})
        assert biased.currents["m.x"] == pytest.approx(closed_form(2.0), rel=1e-6)
        assert biased.dq_dv["drive"]["m.x"] == pytest.approx(biased.di_dv["m.x"]["drive"], rel=1e-9)


def test_samples(client: bimorph.Client) -> None:
    """Samples have the requested moments, the same seed the same values, and what cannot be drawn raises."""
    netlist = bimorph.Netlist.text(PLATE, "plate.net")
    samples = bimorph.Samples({"k": bimorph.LogNormal(1.0, 0.1)}, count=64, seed=5, design="sobol")
    table = client.sweep(netlist, {}, bimorph.Modes(count=1), samples=samples)
    drawn = [float(k) for k in table.column("k") if k is not None]
    assert len(drawn) == 64
    assert sum(math.log(k) for k in drawn) / 64 == pytest.approx(0.0, abs=2e-3)
    assert table.column("f1") == pytest.approx([math.sqrt(k / M) / (2 * math.pi) for k in drawn], rel=1e-9)
    assert client.sweep(netlist, {}, bimorph.Modes(count=1), samples=samples) == table
    with pytest.raises(bimorph.InvalidRequest, match="deviation"):
        wrong = bimorph.Samples({"k": bimorph.Normal(1.0, -1.0)}, count=4)
        client.sweep(netlist, {}, bimorph.Modes(count=1), samples=wrong)


def test_a_server_of_another_version_is_told_once(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once a process, by the first call of any kind; a server of the same version causes none."""
    with bimorph.serve(program) as server:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with server.client() as client:
                client.compile(bimorph.Netlist.text(PLATE))
        monkeypatch.setattr("bimorph.channel.OWN", "0.0.1")
        with pytest.warns(UserWarning) as caught:
            for _ in range(2):
                with server.client() as client:
                    client.compile(bimorph.Netlist.text(PLATE))
                    version = client.version()
        assert [str(warning.message) for warning in caught] == [
            f"server {server.address} is of version {version}, this client of 0.0.1: numbers and options may differ"
        ]


def test_a_connection_that_is_let_go_of_is_found_by_nobody(server: bimorph.Server) -> None:
    """Threads that make clients of one server and drop them share its connection while one of them is there; none finds it while it closes (a
    fifth of the calls said "closed channel")."""
    until, wrong = time.monotonic() + 1.0, []

    def work() -> None:
        while time.monotonic() < until:
            try:
                server.client().version()
            except Exception as error:  # noqa: BLE001
                wrong.append(error)

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before)
    assert not wrong, wrong[0]
