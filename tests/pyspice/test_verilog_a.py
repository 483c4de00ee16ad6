"""Verilog-A that `bimorph export` writes, compiled by OpenVAF, against the full model in ngspice's `.ac`."""

import os
import pathlib
import subprocess

import numpy as np
import pytest

openvaf_py = pytest.importorskip("openvaf_py", reason="OpenVAF has no build for this Python: no module was compiled")

ROOT = pathlib.Path(__file__).resolve().parents[2]

COMMAND = pathlib.Path(os.environ.get("BIMORPH", ROOT / "target/release/bimorph"))

# name, netlist, voltages at the operating point, signals with volts per unit, options, largest deviation: of the linear form that which
# it was fitted to, of the nonlinear one rounding and ngspice's tolerance at the operating point
SCENES = [
    ("bank", "examples/bank/bank.net", {"heat": 1.0, "sense": 10.0}, {"yoke.y": 1e6, "b1.hot.T": 1.0}, [], 1e-3),
    (
        "comb_resonator",
        "examples/comb_resonator/comb_resonator.net",
        {"drive": 20.0, "sense": 10.0},
        {"shuttle.x": 1e6},
        [],
        1e-3,
    ),
    ("comb", "tests/decks/comb.net", {"drive": 5.0, "sense": 10.0}, {"m.x": 1e6, "right.q": 1e15}, ["--nonlinear"], 1e-6),
    ("damped_plate", "tests/decks/damped_plate.net", {"drive": 5.0}, {"m.x": 1e6, "gap.q": 1e15}, ["--nonlinear"], 1e-6),
]


class Module:
    """A compiled module as the equations f(x) + d/dt q(x) = currents from outside, over its nodes and branch currents."""

    def __init__(self, path):
        (self.module,) = openvaf_py.compile_va(str(path))
        self.names = [node["name"] for node in self.module.get_dae_system()["nodes"]]

    def evaluate(self, x):
        """f, and the Jacobians of f and q."""
        at = dict(zip(self.names, x))
        values = {}
        for name in self.module.param_names:
            inner = name[2:-1]
            if name.startswith("V("):
                first, _, second = inner.partition(",")
                values[name] = at[first] - (at[second] if second else 0.0)
            elif name.startswith("I("):
                values[name] = at[f"flow({inner})"]
            else:
                values[name] = 1.0  # mfactor
        residuals, jacobian = self.module.run_init_eval(values)
        n = len(self.names)
        resist, react = np.zeros((n, n)), np.zeros((n, n))
        for row, column, g, c in jacobian:
            resist[row, column] += g
            react[row, column] += c
        return np.array([r for r, _ in residuals]), resist, react


def solve(module, held):
    """The operating point with the nodes `held` at voltages, by Newton's iteration."""
    given = [module.names.index(name) for name in held]
    free = [k for k in range(len(module.names)) if k not in given]
    x = np.zeros(len(module.names))
    for share in np.linspace(0.1, 1.0, 10):
        x[given] = [share * volts for volts in held.values()]
        for _ in range(50):
            f, resist, _ = module.evaluate(x)
            step = np.linalg.solve(resist[np.ix_(free, free)], -f[free])
            x[free] += step
            if np.max(np.abs(step)) < 1e-13 * (1.0 + np.max(np.abs(x))):
                break
    return x, given, free


@pytest.mark.parametrize(("name", "netlist", "bias", "signals", "options", "most"), SCENES, ids=[s[0] for s in SCENES])
def test_a_compiled_module_is_the_full_model(bench, tmp_path, name, netlist, bias, signals, options, most):
    """OpenVAF compiles it, finds neither state but nodes nor a bound on steps, and its small signals are those of the part in ngspice."""
    path = tmp_path / "part.va"
    words = [COMMAND, "export", ROOT / netlist, "--verilog-a", "--name", name, "--out", path, *options]
    words += ["--signals", ",".join(f"{s}:{scale:e}" for s, scale in signals.items())]
    if not options:
        words += [word for port, volts in bias.items() for word in ("--port", f"{port}={volts}")]
    subprocess.run(words, check=True, capture_output=True)
    module = Module(path)
    assert module.module.num_states == 0 and not module.module.has_bound_step
    assert module.module.name == name

    held = {f"p_{port}": volts for port, volts in bias.items()} | {f"n_{port}": 0.0 for port in bias}
    x, given, free = solve(module, held)
    _, resist, react = module.evaluate(x)
    plain = [s.lower().replace(".", "_") for s in signals]
    frequencies = "dec 20 10 60k"
    worst = 0.0
    for driven in bias:
        sources = "".join(f"V{p} p{p} 0 DC {v} AC {int(p == driven)}\n" for p, v in bias.items())
        quoted = lambda words: " ".join(f'"{word}"' for word in words)  # noqa: E731
        waves = bench.run(
            f"* full model\n{sources}A1 %gd [{' '.join(f'p{p} 0' for p in bias)}] %v [{' '.join('s_' + s for s in plain)}] full\n"
            f".model full bimorph(file=\"{ROOT / netlist}\" ports=[{quoted(bias)}] "
            f"monitors=[{quoted(f'{s}:{scale:e}' for s, scale in signals.items())}])\n"
            f".options reltol=1e-9 vntol=1e-12\n.ac {frequencies}\n.end\n"
        )
        for k, hertz in enumerate(np.real(waves["frequency"])):
            matrix = resist + 2j * np.pi * hertz * react
            small = np.zeros(len(x), dtype=complex)
            small[module.names.index(f"p_{driven}")] = 1.0
            small[free] = np.linalg.solve(matrix[np.ix_(free, free)], -matrix[np.ix_(free, given)] @ small[given])
            currents = matrix @ small
            pairs = [(currents[module.names.index(f"p_{p}")], -waves[f"v{p.lower()}#branch"][k]) for p in bias]
            pairs += [(small[module.names.index(f"s_{s}")], waves[f"s_{s}"][k]) for s in plain]
            for written, full in pairs:
                if abs(full) > 1e-18:
                    worst = max(worst, abs(written - full) / abs(full))
                else:
                    assert abs(written) < 1e-18
    print(f"{name}: {len(module.names)} unknowns, within {worst:.1e} of the full model")
    assert worst < most
