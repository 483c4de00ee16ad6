"""Noise, and a relay with its contact: nonlinear files in ngspice 44, 47 and VACASK, against the plug-in in ngspice.

Files of rigid parts have the equations of the plug-in, so that `.op`, `.dc` and `.noise` differ by the tolerance of the simulators (reltol 1e-6). In time a relay bounces, and
positions agree to 1e-3 of the travel.
"""

import re
import shutil
import subprocess

import numpy as np
from test_osdi import COMMAND, ROOT, TOOLS
from test_osdi_flexible import BANK, TOL, apart, everywhere, export, in_vacask, swept

COMB = ROOT / "examples/comb_resonator/comb_resonator.net"
RELAY = ROOT / "examples/relay/relay.net"
SIGNALS = ["a.x:1e6", "tip.N:1e6", "tip.G", "tip.gap:1e6"]


def spectrum(output, source, low, high):
    """Commands of ngspice for the noise of an output; the last plot but one is the spectrum."""
    return f"noise v({output}) {source} dec 10 {low} {high} 1\nsetplot previous"


def density(plot):
    return np.real(plot["onoise_spectrum"])


def written(netlist, folder, signals):
    """Writes part.osdi of rigid parts."""
    words = [COMMAND, "export", netlist, "--osdi", "--openvaf", TOOLS / "openvaf-r", "--nonlinear", "--name", "part", "--out", folder / "part.osdi", "--tol", str(TOL)]
    ran = subprocess.run([*words, "--signals", ",".join(signals)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


def test_a_relay_closes_and_opens(tmp_path):
    """A sweep up and down closes and opens the relay at the steps of the plug-in, with its way, contact force and conductance; a pulse moves it as there; and VACASK has the states
    of ngspice to 1e-4."""
    written(RELAY, tmp_path, SIGNALS)
    control = {"up": "dc Vgate 0 20 0.25", "down": "dc Vgate 20 0 -0.25", "tran": "tran 20n 60u 0 20n"}
    full, plots = everywhere(RELAY, tmp_path, ["gate"], SIGNALS, "Vgate n0 0 0 PULSE(0 20 1u 4u 4u 30u)\n", control)
    sweeps = {"up": swept("up", "vgate", 0, 20, 0.25), "down": swept("down", "vgate", 20, 0, -0.25)}
    other = in_vacask(tmp_path / "vacask", "n0 0 s0 s1 s2 s3", "vgate (n0 0) v dc=0\n", sweeps)
    at = np.linspace(0.0, 60e-6, 600)
    for version, plot in plots.items():
        for name in ("up", "down"):
            worst = max(apart(plot[name], full[name], f"v(s{k})") for k in range(4))
            hosts = max(apart(other[name], plot[name], f"v(s{k})") for k in range(4))
            print(f"relay in ngspice {version}: {name} {worst:.1e}, VACASK {hosts:.1e}")
            assert worst <= 1e-5 and hosts <= 1e-4, (version, name, worst, hosts)
            closed = np.flatnonzero(plot[name]["v(s2)"] > 0.1)
            # it closes between 12.75 and 13 V, √(8kg³/27εA) = 12.94 V, and opens between 10.25 and 10.5 V
            assert (closed[0], len(closed)) == {"up": (52, 29), "down": (0, 39)}[name]
        own, others = (np.interp(at, of["tran"]["time"], of["tran"]["v(s0)"]) for of in (plot, full))
        late = np.max(np.abs(own - others)) / np.ptp(others)
        print(f"relay in ngspice {version}: .tran {late:.1e}")
        assert late <= 1e-3, (version, late)


def test_a_relay_has_noise(tmp_path):
    """The noise of an open and of a closed relay is that of the plug-in, in ngspice to 1e-5 and in VACASK to 1e-4."""
    written(RELAY, tmp_path, SIGNALS)
    for volts, low, high in ((8, 1e3, 1e7), (20, 1e3, 1e8)):
        folder = tmp_path / f"at{volts}"
        folder.mkdir()
        (folder / "part.osdi").symlink_to(tmp_path / "part.osdi")
        control = {"noise": spectrum("s0", "Vgate", low, high)}
        full, plots = everywhere(RELAY, folder, ["gate"], SIGNALS, f"Vgate n0 0 DC {volts} AC 1\n", control)
        words = f'analysis noise noise out="s0" in="vgate" from={low} to={high} mode="dec" points=10'
        vacask = in_vacask(folder / "vacask", "n0 0 s0 s1 s2 s3", f"vgate (n0 0) v dc={volts}\n", {"noise": words})["noise"]
        for version, plot in plots.items():
            worst = np.max(np.abs(density(plot["noise"]) / density(full["noise"]) - 1.0))
            hosts = np.max(np.abs(np.sqrt(np.real(vacask["v(onoise)"])) / density(plot["noise"]) - 1.0))
            print(f"relay at {volts} V in ngspice {version}: noise {worst:.1e}, VACASK {hosts:.1e}")
            assert worst <= 1e-5 and hosts <= 1e-4, (volts, version, worst, hosts)


def test_a_bank_has_noise(tmp_path):
    """Drag moves the yoke of a heated bank as in the plug-in, near its resonance to 1e-3 at 1 V and at 2 V on the heaters, and its warm resistances
    make the noise of the port to 1e-6. With constant masses it was 2.0e-3 and 1.2e-2, with constant damping 1.9e-3 at 2 V."""
    signals = ["yoke.y:1e6"]
    export(BANK, tmp_path, {"heat": "0:2", "sense": "0:20"}, signals)
    control = {"yoke": spectrum("s0", "Vheat", 100, "100k"), "port": spectrum("n0", "Vheat", 100, "100k")}
    for heat in (1, 2):
        folder = tmp_path / f"{heat}V"
        folder.mkdir()
        shutil.copy(tmp_path / "part.osdi", folder)
        sources = f"Vheat nx 0 DC {heat} AC 1\nRh nx n0 100\nVsense n1 0 10\n"
        full, plots = everywhere(BANK, folder, ["heat", "sense"], signals, sources, control)
        for version, plot in plots.items():
            worst = {name: np.max(np.abs(density(plot[name]) / density(full[name]) - 1.0)) for name in control}
            print(f"bank at {heat} V in ngspice {version}: noise of the yoke {worst['yoke']:.1e}, of the port {worst['port']:.1e}")
            assert worst["yoke"] <= 1e-3 and worst["port"] <= 1e-6, (version, worst)


def linear(netlist, folder, bias, signals, *options):
    """Writes part.osdi, linear about an operating point. The largest deviation of its noise that the header states."""
    words = [COMMAND, "export", netlist, "--osdi", "--openvaf", TOOLS / "openvaf-r", "--name", "part", "--out", folder / "part.osdi", "--tol", str(TOL)]
    words += [word for name, volts in bias.items() for word in ("--port", f"{name}={volts}")]
    ran = subprocess.run([*words, "--signals", ",".join(signals), *options], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return float(re.search(r"spectral densities deviate by (\S+)", (folder / "part.va").read_text()).group(1))


def test_a_linear_bank_has_noise(tmp_path):
    """The linear file of a heated bank at 1 V and 10 V has the noise of the plug-in there: of its yoke and of the warm resistances of its port, to what its header states."""
    signals = ["yoke.y:1e6", "yoke.vy:1e3"]
    stated = linear(BANK, tmp_path, {"heat": 1, "sense": 10}, signals)
    control = {"yoke": spectrum("s0", "Vheat", 100, "100k"), "rate": spectrum("s1", "Vheat", 100, "100k"), "port": spectrum("n0", "Vheat", 100, "100k")}
    sources = "Vheat nx 0 DC 1 AC 1\nRh nx n0 1m\nVsense n1 0 10\n"
    full, plots = everywhere(BANK, tmp_path, ["heat", "sense"], signals, sources, control)
    for version, plot in plots.items():
        worst = {name: np.max(np.abs((density(plot[name]) / density(full[name])) ** 2 - 1.0)) for name in control}
        print(f"linear bank in ngspice {version}: stated {stated:.1e}, noise of the yoke {worst['yoke']:.1e}, its rate {worst['rate']:.1e}, of the port {worst['port']:.1e}")
        assert max(worst.values()) <= stated + 1e-5 and stated <= 1e-3, (version, worst, stated)


def test_a_linear_comb_has_noise(tmp_path):
    """The noise of the displacement of a comb resonator, and behind 1 GΩ of the current through its capacitance, is that of the plug-in to what the header states. VACASK has
    that of ngspice."""
    stated = linear(COMB, tmp_path, {"drive": 20, "sense": 10}, ["shuttle.x:1e6"])
    held = "Vdrive n0 0 DC 20 AC 1\nVsense n1 0 10\n"
    behind = "Vdrive n0 0 DC 20 AC 1\nVsense ns 0 10\nRs ns n1 1G\n"
    words = 'analysis noise noise out="s0" in="vdrive" from=100 to=100k mode="dec" points=10'
    vacask = in_vacask(tmp_path / "vacask", "n0 0 n1 0 s0", "vdrive (n0 0) v dc=20\nvsense (n1 0) v dc=10\n", {"noise": words})["noise"]
    for output, sources in (("s0", held), ("n1", behind)):
        folder = tmp_path / output
        folder.mkdir()
        (folder / "part.osdi").symlink_to(tmp_path / "part.osdi")
        full, plots = everywhere(COMB, folder, ["drive", "sense"], ["shuttle.x:1e6"], sources, {"noise": spectrum(output, "Vdrive", 100, "100k")})
        for version, plot in plots.items():
            worst = np.max(np.abs((density(plot["noise"]) / density(full["noise"])) ** 2 - 1.0))
            print(f"linear comb in ngspice {version}: stated {stated:.1e}, noise of {output} {worst:.1e}")
            assert worst <= stated + 1e-5 and stated <= 1e-3, (version, output, worst, stated)
            if output == "s0":
                hosts = np.max(np.abs(np.sqrt(np.real(vacask["v(onoise)"])) / density(plot["noise"]) - 1.0))
                print(f"linear comb in ngspice {version}: VACASK {hosts:.1e}")
                assert hosts <= 1e-4, (version, hosts)


LEVER = """* a cantilever that a gate pulls, with a gold tip that bears on a contact and loses energy there
process p = [Youngsmodulus=169e9 density=2330 h=10u]
anchor p [f] []
beam2d p [f a] [l=80u w=1u]
beam2d p [a b] [l=20u w=2u]
dashpot2d * [a] [bx=2e-7 by=2e-7]
field plategap2d * [a g] [A=4e-10 gap=1u oz=-pi/2 fringe=none]
anchor * [g] []
tip stop2d * [b] [gap=0.5u oz=-pi/2 A=1e-12 hardness=2G contactresistivity=22n electronpath=38n restitution=0.5]
eground * [a] []
gate port * [g a] []
"""


def test_a_flexible_relay(tmp_path):
    """The reduced file of a relay on a cantilever has the displacement, the way, the contact force and the conductance of the plug-in in sweeps through contact, to 1e-4 of their
    ranges. Below its second resonance it has the noise of the open and of the closed relay, with the losses of its contact, to 1e-3."""
    netlist = tmp_path / "lever.net"
    netlist.write_text("%" + LEVER[1:])
    signals = ["b.y:1e6", "tip.gap:1e6", "tip.N:1e6", "tip.G"]
    export(netlist, tmp_path, {"gate": "0:12"}, signals)
    control = {"up": "dc Vgate 0 12 0.25", "down": "dc Vgate 12 0 -0.25"}
    full, plots = everywhere(netlist, tmp_path, ["gate"], signals, "Vgate n0 0 0\n", control)
    for version, plot in plots.items():
        for name in control:
            worst = [apart(plot[name], full[name], f"v(s{k})") for k in range(4)]
            print(f"flexible relay in ngspice {version}: {name} {' '.join(f'{x:.1e}' for x in worst)}")
            assert max(worst) <= 1e-4, (version, name, worst)
    for volts, high, outputs in ((6, "200k", ["s0"]), (11, "200k", ["s0", "s2", "s3"])):
        folder = tmp_path / f"at{volts}"
        folder.mkdir()
        (folder / "part.osdi").symlink_to(tmp_path / "part.osdi")
        control = {output: spectrum(output, "Vgate", "1k", high) for output in outputs}
        full, plots = everywhere(netlist, folder, ["gate"], signals, f"Vgate n0 0 DC {volts} AC 1\n", control)
        for version, plot in plots.items():
            worst = {name: np.max(np.abs(density(plot[name]) / density(full[name]) - 1.0)) for name in control}
            print(f"flexible relay at {volts} V in ngspice {version}: noise {worst}")
            assert max(worst.values()) <= 1e-3, (volts, version, worst)
