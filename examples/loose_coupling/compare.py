"""Loose against tight coupling of a plate to a circuit: the same device, circuit and steps, with four ways of exchanging values.

    python examples/loose_coupling/compare.py [--out FILE.svg]

A source drives a plate on a spring through a resistor or a capacitor. The circuit is integrated by the trapezoidal rule with equal steps.

tight     the device is evaluated inside the Newton iteration of each step, with the derivative of its charge
serial    the circuit is solved with the capacitance of the last step, then the mechanism moves along the new voltage
parallel  the circuit is solved with the capacitance of the last step, and the mechanism moves along the voltage of the last step
current   the circuit is solved with the current of the last step, then the mechanism moves along the new voltage

Prints the tables of docs/explanation/loose_coupling.md. Requires the program ``bimorph``, ngspice and its plug-in.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import bimorph
from bimorph import ngspice

NETLIST = Path(__file__).resolve().parent / "plate.net"
STIFFNESS, MASS, DAMPING, EPSILON_AREA, GAP = 1.0, 1e-10, 2e-6, 8.854e-12 * 1e-8, 2e-6
"""The numbers of the netlist [N/m, kg, N·s/m, F·m, m]."""
SIGNALS = ["m.x", "m.vx", "gap.C"]
SCHEMES = ["tight", "serial", "parallel", "current"]
STEPS = [4e-6, 2e-6, 1e-6, 0.5e-6]
"""Steps of the circuit [s]."""
SMALL, LARGE = 1e4, 1e8
"""Resistors [ohm]: time constants of 0.4 ns and 4.4 us with the plate at rest."""
NAMES = {SMALL: "10 kohm", LARGE: "100 Mohm"}
SLOPE, PULSE = 2e4, 80e-6
"""Slope of the ramp [V/s] and length of the pulse [s]."""
SERIES, RISE, HELD = 20e-15, 200e-6, 520e-6
"""The series capacitor [F], the rise of its source [s] and the end of the run [s]."""
TOLERANCE = 1e-5
"""Tolerance of the model."""

Source = Callable[[float], float]
Array = NDArray[np.float64]


class Resistor:
    """A resistor between source and plate, by the trapezoidal rule; the first step by backward Euler, as in ngspice."""

    def __init__(self, ohms: float) -> None:
        self.ohms, self.charge, self.current, self.weight = ohms, 0.0, 0.0, 1.0

    def supply(self, source: float, step: float) -> tuple[float, float]:
        """Charge [C] delivered to a plate at 0 V by the end of a step, and the charge for each volt less of the plate [F]."""
        slope = self.weight * step / self.ohms
        return self.charge + (1.0 - self.weight) * step * self.current + slope * source, slope

    def held(self, source: float, step: float, current: float) -> float:
        """Voltage [V] of the plate where it draws this current [A]."""
        return source - self.ohms * current

    def advance(self, source: float, voltage: float, step: float) -> None:
        """Accepts the voltage of the plate at the end of a step."""
        start, slope = self.supply(source, step)
        self.charge, self.current, self.weight = start - slope * voltage, (source - voltage) / self.ohms, 0.5


class Capacitor:
    """A capacitor between source and plate; charge is conserved under any rule."""

    def __init__(self, farads: float) -> None:
        self.farads, self.charge = farads, 0.0

    def supply(self, source: float, step: float) -> tuple[float, float]:
        """Charge [C] delivered to a plate at 0 V by the end of a step, and the charge for each volt less of the plate [F]."""
        return self.farads * source, self.farads

    def held(self, source: float, step: float, current: float) -> float:
        """Voltage [V] of the plate where it draws this current [A]."""
        return source - (self.charge + step * current) / self.farads

    def advance(self, source: float, voltage: float, step: float) -> None:
        """Accepts the voltage of the plate at the end of a step."""
        self.charge = self.farads * (source - voltage)


Branch = Resistor | Capacitor


@dataclass
class Run:
    """Waveforms of a run, and its cost."""

    step: float
    x: list[float] = field(default_factory=lambda: [0.0])
    """Displacement of the plate [m]."""
    speed: list[float] = field(default_factory=lambda: [0.0])
    """Its speed [m/s]."""
    evaluations: int = 0
    """Evaluations of the device."""
    diverged: bool = False
    """Whether the voltage of the plate exceeded twice the largest of the source. No circuit here can supply that."""

    def wave(self) -> Array:
        """Times, places and speeds of the plate."""
        return np.array([[self.step * k, *state] for k, state in enumerate(zip(self.x, self.speed))]).T


def tight_step(session: bimorph.Session, branch: Branch, source: float, guess: float, run: Run) -> tuple[float, bimorph.TrialReply]:
    """Voltage of the plate at the end of a step, by Newton iteration over trials of the device, and the reply at it."""
    start, slope = branch.supply(source, run.step)
    voltage = guess
    for _ in range(30):
        reply = session.trial({"drive": voltage}, run.step)
        run.evaluations += 1
        if reply.need_dt is not None:
            raise RuntimeError(f"the device requires steps below {reply.need_dt:.3g} s")
        excess = reply.charges["drive"] - (start - slope * voltage)
        change = -excess / (reply.dq_dv["drive"]["drive"] + slope)
        if abs(change) < 1e-9 * max(1.0, abs(voltage)):
            session.accept(reply)
            return voltage, reply
        voltage += change
    raise RuntimeError(f"no convergence of a step of {run.step:.3g} s")


def simulate(model: bimorph.Model, scheme: str, branch: Branch, source: Source, step: float, stop: float, upto: float = math.inf) -> Run:
    """A run from rest with equal steps, until the plate has moved by ``upto`` [m]."""
    run = Run(step)
    voltage, before, current, charge, peak = 0.0, 0.0, 0.0, 0.0, 0.0
    with model.session(SIGNALS) as session:
        capacitance = session.operating_point({"drive": 0.0}).outputs["gap.C"]
        for k in range(1, round(stop / step) + 1):
            volts = source(k * step)
            peak = max(peak, abs(volts))
            if scheme == "tight":
                new, reply = tight_step(session, branch, volts, 2.0 * voltage - before, run)
            else:
                start, slope = branch.supply(volts, step)
                new = branch.held(volts, step, current) if scheme == "current" else start / (capacitance + slope)
                run.diverged = abs(new) > 2.0 * peak
                if run.diverged:
                    break
                reply = session.step({"drive": voltage if scheme == "parallel" else new}, step)
                run.evaluations += 1
            branch.advance(volts, new, step)
            before, voltage, capacitance = voltage, new, reply.outputs["gap.C"]
            current, charge = (reply.charges["drive"] - charge) / step, reply.charges["drive"]
            run.x.append(reply.outputs["m.x"])
            run.speed.append(reply.outputs["m.vx"])
            if run.x[-1] > upto:
                break
    return run


def passes(wave: Array, level: float) -> float:
    """Time at which the plate first passes a level [s], by the cubic through places and speeds."""
    times, x, speed = wave
    k = int(np.argmax(x > level))
    h, left, right = times[k] - times[k - 1], 0.0, 1.0
    for _ in range(60):
        s = 0.5 * (left + right)
        ends = x[k - 1] + (x[k] - x[k - 1]) * s * s * (3.0 - 2.0 * s)
        inner = s * (1.0 - s) * h * (speed[k - 1] * (1.0 - s) - speed[k] * s)
        left, right = (s, right) if ends + inner < level else (left, s)
    return float(times[k - 1] + h * left)


def exact(source: Source, ohms: float, stop: float, level: float) -> Array:
    """Times, places and speeds of the plate until it has moved by ``level`` [m]: the differential equations by the classical Runge-Kutta
    method, without the device. With the small resistor the charge follows the voltage, to the second order of the time constant."""

    def rate(t: float, x: float, v: float, q: float) -> tuple[float, float, float]:
        space, volts = GAP - x, source(t)
        if ohms == SMALL:
            slope = 5e8 * (source(t + 1e-9) - source(t - 1e-9))
            volts -= ohms * EPSILON_AREA * (slope / space + volts * v / space**2)
            return v, (0.5 * EPSILON_AREA * (volts / space) ** 2 - STIFFNESS * x - DAMPING * v) / MASS, 0.0
        return v, (0.5 * q * q / EPSILON_AREA - STIFFNESS * x - DAMPING * v) / MASS, (volts - q * space / EPSILON_AREA) / ohms

    h, points, (x, v, q) = 1e-7, [(0.0, 0.0, 0.0)], (0.0, 0.0, 0.0)
    while x < level and points[-1][0] < stop:
        t, dx, dv, dq, (a, b, c) = points[-1][0], 0.0, 0.0, 0.0, (0.0, 0.0, 0.0)
        for part, weight in ((0.0, h / 6.0), (0.5 * h, h / 3.0), (0.5 * h, h / 3.0), (h, h / 6.0)):
            a, b, c = rate(t + part, x + part * a, v + part * b, q + part * c)
            dx, dv, dq = dx + weight * a, dv + weight * b, dq + weight * c
        x, v, q = x + dx, v + dv, q + dq
        points.append((t + h, x, v))
    return np.array(points).T


def ramp(t: float) -> float:
    """The source of the ramp [V]."""
    return SLOPE * t


def pulse(volts: float) -> Source:
    """A smooth pulse of this amplitude."""
    return lambda t: volts * math.sin(math.pi * t / PULSE) ** 2 if t < PULSE else 0.0


def threshold(pulls_in: Callable[[float], bool]) -> float:
    """Smallest amplitude of a pulse that pulls the plate in [V], to 1 mV."""
    low, high = 6.5, 7.5
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if pulls_in(middle) else (middle, high)
    return high


def raised(volts: float) -> Source:
    """A source that rises along half a cosine, then stays."""
    return lambda t: 0.5 * volts * (1.0 - math.cos(math.pi * min(t / RISE, 1.0)))


def damping(x: Array, step: float) -> float:
    """Damping of an oscillation in equal steps, as a fraction of the damper's: x follows a linear recurrence of two steps. Infinite
    where the amplitude does not decay."""
    last = round(80e-6 / step)
    if np.ptp(x[-last:]) > np.ptp(x[:last]):
        return math.inf
    stride = round(4e-6 / step)
    x = x[::stride]
    rows = np.column_stack([x[1:-1], x[:-2], np.full(len(x) - 2, GAP)])
    product = float(np.linalg.lstsq(rows, x[2:], rcond=None)[0][1])
    return -0.5 * math.log(-product) / (stride * step) * 2.0 * MASS / DAMPING


def source_volts(x: float) -> float:
    """Voltage of the source behind the series capacitor for an equilibrium at x [V]: the force of a charge does not depend on the gap."""
    charge = math.sqrt(2.0 * EPSILON_AREA * STIFFNESS * x)
    return charge * ((GAP - x) / EPSILON_AREA + 1.0 / SERIES)


def delayed_stiffness(x: float) -> float:
    """Stiffness by which the capacitor holds the plate at x [N/m], which a loose scheme applies one step late."""
    capacitance = EPSILON_AREA / (GAP - x)
    return 2.0 * STIFFNESS * x / (GAP - x) * capacitance / (capacitance + SERIES)


def deck(source: str, branch: str, stop: float) -> Array:
    """Times, places and speeds of the same circuit in ngspice, with steps of at most 1 us."""
    text = f"""* a plate behind a resistor or a capacitor
B1 s 0 V={source}
{branch}
Rl a 0 1e18
A1 %gd [a 0] %v [x v] plate
.model plate bimorph(file="{NETLIST}" monitors=["m.x:1e6" "m.vx:1"] tol={TOLERANCE})
.tran 1u {stop} 0 1u
.end
"""
    run = ngspice.run(text)
    return np.array([run["time"], 1e-6 * run["v(x)"], run["v(v)"]])


def show(head: str, names: list[str], table: dict[float, list[float]], digits: int) -> None:
    """Prints a table by steps."""
    print(f"\n{head}\nstep [us]" + "".join(f"{name:>12}" for name in names))
    for step, values in table.items():
        words = ["diverges" if math.isnan(v) else "oscillates" if math.isinf(v) else f"{v:z.{digits}f}" for v in values]
        print(f"{1e6 * step:9.1f}" + "".join(f"{word:>12}" for word in words))


def ramps(model: bimorph.Model, ohms: float) -> dict[float, list[float]]:
    """Errors of the time at which the plate on a ramp passes half its gap [s], by step; prints them."""
    expected, table, evaluations, count = passes(exact(ramp, ohms, 1.0, 0.6 * GAP), 0.5 * GAP), {}, 0, 0
    for step in STEPS:
        runs = {scheme: simulate(model, scheme, Resistor(ohms), ramp, step, 400e-6, 0.6 * GAP) for scheme in SCHEMES}
        table[step] = [math.nan if run.diverged else passes(run.wave(), 0.5 * GAP) - expected for run in runs.values()]
        evaluations, count = evaluations + runs["tight"].evaluations, count + len(runs["tight"].x) - 1
    head = f"ramp behind {NAMES[ohms]}, half the gap at {1e6 * expected:.3f} us: error of this time [ns]"
    show(head, SCHEMES, {step: [1e9 * error for error in errors] for step, errors in table.items()}, 1)
    wave = deck(f"{SLOPE}*time", f"R1 s a {ohms}", 1.05 * expected)
    print(f"ngspice: {1e9 * (passes(wave, 0.5 * GAP) - expected):z.1f}; device evaluations a step: tight {evaluations / count:.1f}, others 1")
    return table


def pulses(model: bimorph.Model) -> None:
    """Prints the smallest pulse behind the large resistor that pulls the plate in."""
    level, stop = 0.8 * GAP, 2.0 * PULSE
    expected = threshold(lambda volts: bool(exact(pulse(volts), LARGE, stop, level)[1, -1] > level))
    table = {}
    for step in STEPS[:3]:
        table[step] = [
            threshold(lambda volts: simulate(model, scheme, Resistor(LARGE), pulse(volts), step, stop, level).x[-1] > level)
            for scheme in SCHEMES[:3]
        ]
    show(f"pulse behind {NAMES[LARGE]}, pull-in from {expected:.2f} V: amplitude from which it pulls in [V]", SCHEMES[:3], table, 2)


def charges(model: bimorph.Model, x: float) -> tuple[dict[tuple[float, str], Run], Array]:
    """Runs behind the series capacitor by step and scheme, and that of ngspice; prints the damping at this equilibrium [m]."""
    volts, limit = source_volts(x), DAMPING / delayed_stiffness(x)
    kept: dict[tuple[float, str], Run] = {}
    table: dict[float, list[float]] = {}
    for step in STEPS:
        runs = {scheme: simulate(model, scheme, Capacitor(SERIES), raised(volts), step, HELD) for scheme in SCHEMES}
        table[step] = [math.nan if run.diverged else damping(np.array(run.x[round(RISE / step) :]), step) for run in runs.values()]
        table[step].append(1.0 - step / limit)
        kept |= {(step, scheme): run for scheme, run in runs.items()}
    head = f"series capacitor, {volts:.2f} V, plate at {x / GAP:.2f} of the gap, b/k_f = {1e6 * limit:.2f} us: damping, exact 1"
    show(head, [*SCHEMES, "1-h*k_f/b"], table, 3)
    wave = deck(f"{0.5 * volts}*(1-cos(pi*min(time/{RISE},1)))", f"C1 s a {SERIES}", HELD)
    print(f"ngspice: {damping(np.interp(np.arange(RISE, HELD, 1e-6), wave[0], wave[1]), 1e-6):.3f}")
    return kept, wave


def limits(model: bimorph.Model) -> None:
    """Prints how the current scheme behind a resistor depends on the step, and the longest steps of the tight scheme."""
    ohms, words = 2e7, []
    for factor in (0.6, 0.9, 1.1, 2.0):
        step = factor * 2.0 * ohms * EPSILON_AREA / GAP
        run = simulate(model, "current", Resistor(ohms), lambda t: 1.0, step, 100.0 * step)
        words.append(f"{factor:.1f} {'diverges' if run.diverged else 'stable'}")
    print("\ncurrent behind a resistor, step as a multiple of 2*R*C: " + ", ".join(words))
    source = raised(source_volts(0.5 * GAP))
    for step in (4e-6, 20e-6, 40e-6):
        try:
            run = simulate(model, "tight", Capacitor(SERIES), source, step, HELD)
            found = f"{run.evaluations / (len(run.x) - 1):.1f} evaluations a step, {1e6 * run.x[-1]:.3f} um at the end"
        except RuntimeError as error:
            found = str(error)
        print(f"tight behind the capacitor, step of {1e6 * step:.1f} us: {found}")


def draw(file: str, errors: dict[float, list[float]], runs: dict[tuple[float, str], Run], wave: Array) -> None:
    """Draws the errors behind the large resistor and the motion behind the capacitor."""
    import matplotlib
    from matplotlib import pyplot

    matplotlib.rcParams.update({"svg.hashsalt": "loose", "svg.fonttype": "none", "font.size": 9})
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    steps = 1e6 * np.array(STEPS)
    for k, scheme in enumerate(SCHEMES[:2]):
        left.loglog(steps, [1e9 * abs(errors[step][k]) for step in STEPS], f"C{k}o-", label=scheme)
    for order, size in ((1, 250.0), (2, 4.0)):
        left.loglog(steps, size * steps**order, "k:", lw=0.8)
        left.annotate(f"order {order}", (2.2, size * 2.2**order * (0.6 if order == 1 else 2.0)))
    left.set(xlabel="step [µs]", ylabel="error of the pull-in time [ns]", title="Ramp behind 100 MΩ")
    left.set_xticks(steps, [f"{step:g}" for step in steps], minor=False)
    left.set_xticks([], minor=True)
    left.legend()
    for step, scheme, style in ((2e-6, "serial", "C1-"), (0.5e-6, "serial", "C3-"), (2e-6, "tight", "C0-")):
        run = runs[step, scheme]
        right.plot(*(1e6 * run.wave()[:2]), style, lw=1.2, label=f"{scheme}, {1e6 * step:g} µs")
    right.plot(1e6 * wave[0], 1e6 * wave[1], "k:", lw=1.2, label="ngspice, 1 µs")
    right.set(xlabel="t [µs]", ylabel="displacement [µm]", title="Series capacitor of 20 fF")
    right.legend(loc="upper left", fontsize=8)
    figure.savefig(file, metadata={"Date": None} if file.endswith(".svg") else None)


def main() -> None:
    """Computes and prints everything."""
    parser = argparse.ArgumentParser(description="Loose against tight coupling of a plate to a circuit.")
    parser.add_argument("--out", metavar="FILE", help="draw the result (.svg, .png; needs matplotlib)")
    arguments = parser.parse_args()
    with bimorph.serve() as server:
        model = server.client().compile(NETLIST, tol=TOLERANCE)
        ramps(model, SMALL)
        errors = ramps(model, LARGE)
        pulses(model)
        charges(model, 0.05 * GAP)
        runs, wave = charges(model, 0.5 * GAP)
        limits(model)
    if arguments.out:
        draw(arguments.out, errors, runs, wave)


if __name__ == "__main__":
    main()
