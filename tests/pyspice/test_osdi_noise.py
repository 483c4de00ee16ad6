"""Noise, and a relay with its contact: nonlinear files in ngspice 44, 47 and VACASK, against the plug-in in ngspice.

Files of rigid parts have the equations of the plug-in, so that `.op`, `.dc` and `.noise` differ by the tolerance of the simulators (reltol 1e-6). In time a relay bounces, and
positions agree to 1e-3 of the travel.
"""

import subprocess

import numpy as np
from test_osdi import COMMAND, ROOT, TOOLS
from test_osdi_flexible import BANK, TOL, apart, everywhere, export, in_vacask, swept

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
    """Drag moves the yoke of a heated bank as in the plug-in, to 2e-3 at its resonance, and its warm resistances make the noise of the port to 1e-6."""
    signals = ["yoke.y:1e6"]
    export(BANK, tmp_path, {"heat": "0:2", "sense": "0:20"}, signals)
    control = {"yoke": spectrum("s0", "Vheat", 100, "100k"), "port": spectrum("n0", "Vheat", 100, "100k")}
    sources = "Vheat nx 0 DC 1 AC 1\nRh nx n0 100\nVsense n1 0 10\n"
    full, plots = everywhere(BANK, tmp_path, ["heat", "sense"], signals, sources, control)
    for version, plot in plots.items():
        worst = {name: np.max(np.abs(density(plot[name]) / density(full[name]) - 1.0)) for name in control}
        print(f"bank in ngspice {version}: noise of the yoke {worst['yoke']:.1e}, of the port {worst['port']:.1e}")
        assert worst["yoke"] <= 2e-3 and worst["port"] <= 1e-6, (version, worst)
