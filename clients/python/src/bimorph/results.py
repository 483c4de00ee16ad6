"""Results of analyses. All quantities are SI."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from . import labelled, plots, showing
from .trial_reply import TrialReply as TrialReply

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

_MOTION = {"x": "m", "y": "m", "rz": "rad"}
"""Components of the motion of a node, and their units."""
_MODES = {"frequency_hz": "Hz", "residual": "1", "error": "1"}
"""Numbers of a mode, and their units."""


@dataclass(frozen=True)
class NodeMotion:
    """Displacement of a node from its undeformed position."""

    x: float
    """Displacement along x [m]; in a mode shape [1]."""
    y: float
    """Displacement along y [m]; in a mode shape [1]."""
    rz: float
    """Rotation about z [rad]; in a mode shape [rad/m]."""


@dataclass(frozen=True)
class AnchorForce:
    """Force of a driven anchor on the mechanism."""

    fx: float
    """Along x [N]."""
    fy: float
    """Along y [N]."""
    m: float
    """Moment about its node [N·m]."""


@dataclass(frozen=True)
class StabilityLoss:
    """Point of the loading path from rest at which the equilibrium loses its stability."""

    kind: Literal["limit-point", "bifurcation"]
    """``"limit-point"``: the branch turns back, as at pull-in and snap-through. ``"bifurcation"``: another branch crosses, as at buckling."""
    fraction: float
    """Fraction of the load [1]."""
    direction: str
    """Where the part moves: the beam that bends and its side, seen along its drawn direction, or a body."""


@dataclass(frozen=True)
class StaticResult:
    """A static equilibrium."""

    nodes: dict[str, NodeMotion]
    """Every mechanical node, in netlist order."""
    temperatures_k: dict[str, float]
    """Mean temperature of every heated or prescribed beam [K]."""
    currents_a: dict[str, float]
    """Current into each port [A]."""
    charges_c: dict[str, float]
    """Charge on each port [C]."""
    pulled_in: bool
    """Whether the part pulled in between rest and the load."""
    unknowns: int
    """Mechanical unknowns."""
    iterations: int
    """Newton iterations over all load steps."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh [1]; None without an estimate."""
    jumped: bool = False
    """Whether it lost its stability between rest and the load: pull-in, snap-through or buckling."""
    warnings: tuple[str, ...] = ()
    """Warnings about the result."""
    free_motions: tuple[str, ...] = ()
    """Motions without noticeable stiffness and without load; they are fixed at their undeformed position."""
    passed: tuple[StabilityLoss, ...] = ()
    """Losses of stability between rest and the load, in their order."""
    permanent_strains: dict[str, float] = field(default_factory=dict)
    """Permanent strain of each beam that can yield [1], negative if it is shorter; of a call with ``backbend``."""
    stresses_pa: dict[str, float] = field(default_factory=dict)
    """Largest stress on the faces of each beam whose layer has a ``strength`` [Pa]."""
    peak_temperatures_k: dict[str, float] = field(default_factory=dict)
    """Highest temperature along every heated beam [K]."""
    nominal_stresses_pa: dict[str, float] = field(default_factory=dict)
    """The stresses without the concentration at fillets [Pa], of beams whose layer has a ``strength`` and a ``fillet``."""
    anchor_forces: dict[str, AnchorForce] = field(default_factory=dict)
    """Force of each driven anchor on the mechanism, by its node."""

    def to_pandas(self) -> pandas.DataFrame:
        """Displacement [m] and rotation [rad] of every node; ``attrs["units"]`` has the units."""
        return showing.frame(self._columns(), ("node", list(self.nodes)), _MOTION)

    def to_xarray(self) -> xarray.Dataset:
        """The columns of :meth:`to_pandas`, by node; each array has its unit in ``attrs["units"]``."""
        about = {"estimated_error": self.estimated_error, "pulled_in": int(self.pulled_in), "jumped": int(self.jumped)}
        return labelled.dataset(("node", list(self.nodes), ""), self._columns(), _MOTION, about)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the displacement of every node."""
        return plots.static(self, ax)

    def _columns(self) -> dict[str, list[float]]:
        return {axis: [getattr(node, axis) for node in self.nodes.values()] for axis in _MOTION}

    def _repr_html_(self) -> str:
        rows = ((name, node.x, node.y, node.rz) for name, node in self.nodes.items())
        way = "pulled in below the load" if self.pulled_in else "snapped through or buckled below the load" if self.jumped else ""
        held = [f"fixed at its undeformed position: {motion}" for motion in self.free_motions]
        losses = [f"{loss.kind} at {loss.fraction:.4g} of the load ({loss.direction})" for loss in self.passed]
        strains = [f"permanent strain of {name}: {strain:.3e}" for name, strain in self.permanent_strains.items()]
        note = showing.note(self.estimated_error, [*filter(None, [way]), *losses, *strains, *held, *self.warnings])
        return showing.table(["node", "x [m]", "y [m]", "rz [rad]"], rows, note)


@dataclass(frozen=True)
class ModeLoss:
    """1/Q of a mode by cause [1]."""

    frequency_hz: float
    """Frequency without damping [Hz]."""
    drag: float
    """Drag under parts, and dampers."""
    gas: float
    """Gas in gaps."""
    thermoelastic: float
    """Heat that flows across bent beams."""
    electrical: float
    """Current through resistances of the netlist."""
    anchors: float
    """Waves that leave through anchors, as layers give them."""

    @property
    def quality(self) -> float:
        """Q [1]; infinite without any loss."""
        total = self.drag + self.gas + self.thermoelastic + self.electrical + self.anchors
        return 1.0 / total if total > 0.0 else math.inf


@dataclass(frozen=True)
class ModesResult:
    """Undamped modes."""

    frequencies_hz: list[float]
    """Ascending [Hz]."""
    residuals: list[float]
    """Relative residual of each mode [1]."""
    shapes: list[dict[str, NodeMotion]]
    """For each mode, every node; largest translation 1."""
    unknowns: int
    """Mechanical unknowns."""
    errors: list[float | None]
    """Estimated relative error of each frequency by the mesh [1], signed; None without an estimate."""
    deflection_m: float = 0.0
    """Largest displacement of the operating point [m]."""
    warnings: tuple[str, ...] = ()
    """Warnings about the result."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh, of all frequencies and of the operating point [1]; None without an estimate."""
    losses: tuple[ModeLoss, ...] = ()
    """Losses of the modes by cause, with ``quality``."""

    def to_pandas(self) -> pandas.DataFrame:
        """Frequency [Hz], residual and estimated error, by number from 1."""
        columns = {"frequency_hz": self.frequencies_hz, "residual": self.residuals, "error": self.errors}
        return showing.frame(columns, ("mode", range(1, len(self.frequencies_hz) + 1)), _MODES)

    def to_xarray(self) -> xarray.Dataset:
        """The columns of :meth:`to_pandas`, and the shapes ``x``, ``y`` and ``rz`` by mode and node, each with its unit in ``attrs["units"]``."""
        errors = [math.nan if error is None else error for error in self.errors]
        columns = {"frequency_hz": self.frequencies_hz, "residual": self.residuals, "error": errors}
        modes = ("mode", range(1, len(self.frequencies_hz) + 1), "")
        found = labelled.dataset(modes, columns, _MODES, {"estimated_error": self.estimated_error, "deflection_m": self.deflection_m})
        nodes = list(self.shapes[0]) if self.shapes else []
        found = found.assign_coords(node=nodes)
        for axis, unit in (("x", "1"), ("y", "1"), ("rz", "rad/m")):
            shapes = np.array([[getattr(shape[node], axis) for node in nodes] for shape in self.shapes]).reshape(len(self.shapes), len(nodes))
            found[axis] = (("mode", "node"), shapes, {"units": unit})
        return found

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the frequency of every mode, with its estimated error."""
        return plots.modes(self, ax)

    def _repr_html_(self) -> str:
        rows = zip(range(1, len(self.frequencies_hz) + 1), self.frequencies_hz, self.errors)
        return showing.table(
            ["mode", "frequency [Hz]", "error [1]"], rows, showing.note(self.estimated_error, self.warnings)
        )


@dataclass(frozen=True)
class Root:
    """A pole or a zero. Of a conjugate pair, the one in the upper half plane."""

    s: complex
    """Complex frequency [rad/s]."""

    @property
    def frequency_hz(self) -> float:
        """Frequency ``|s|/2π`` [Hz]."""
        return abs(self.s) / math.tau

    @property
    def quality(self) -> float | None:
        """Quality factor ``|s|/(2·|Re s|)`` [1]; None without damping."""
        return abs(self.s) / (2.0 * abs(self.s.real)) if self.s.real else None

    @property
    def width_hz(self) -> float:
        """−3 dB bandwidth of a lightly damped resonance [Hz]."""
        return abs(self.s.real) / math.pi


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Small-signal frequency response."""

    drive: str
    """Name of the input."""
    drive_unit: str
    """Unit of the input."""
    frequencies_hz: NDArray[np.float64]
    """Ascending [Hz]."""
    signals: dict[str, NDArray[np.complex128]]
    """Response of each signal per unit of the input; NaN at an undamped resonance."""
    units: dict[str, str]
    """Unit of each signal divided by that of the input."""
    at_rest: dict[str, float | None]
    """Static response of each signal; None if the mechanism is not held."""
    poles: list[Root] | None
    """Poles within the band; None if there are too many."""
    zeros: dict[str, list[Root] | None]
    """Zeros of each signal within the band; None if they were not computed."""
    points_added: int
    """Number of frequencies that were added near resonances and zeros."""
    modes: int | None
    """Number of superposed modes; None for an exact solution."""
    modal_error: float | None
    """Largest relative deviation of the superposition from the exact response; None for an exact solution."""
    unknowns: int
    """Mechanical unknowns."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh, of the response or of its frequency [1]; None without an estimate."""
    warnings: tuple[str, ...] = field(default=())
    """Warnings about the result."""

    @property
    def magnitude(self) -> dict[str, NDArray[np.float64]]:
        """Magnitude of each signal, in its unit."""
        return {name: np.abs(values) for name, values in self.signals.items()}

    @property
    def phase(self) -> dict[str, NDArray[np.float64]]:
        """Phase of each signal, between -π and π [rad]."""
        return {name: np.angle(values) for name, values in self.signals.items()}

    def to_pandas(self) -> pandas.DataFrame:
        """A complex column for each signal, by frequency [Hz]; ``attrs["units"]`` has the units."""
        return showing.frame(self.signals, ("frequency_hz", self.frequencies_hz), {"frequency_hz": "Hz", **self.units})

    def to_xarray(self) -> xarray.Dataset:
        """The signals of :meth:`to_pandas`, each with its unit in ``attrs["units"]``."""
        about = {"drive": self.drive, "drive_unit": self.drive_unit, "estimated_error": self.estimated_error}
        return labelled.dataset(("frequency_hz", self.frequencies_hz, "Hz"), self.signals, self.units, about)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the magnitude of every signal over frequency, both on logarithmic scales."""
        return plots.response(self, ax)

    def _repr_html_(self) -> str:
        head = ["f [Hz]", *(f"|{name}| [{self.units[name]}]" for name in self.signals)]
        rows = zip(self.frequencies_hz.tolist(), *(values.tolist() for values in self.magnitude.values()))
        return showing.table(head, rows, showing.note(self.estimated_error, self.warnings))


@dataclass(frozen=True)
class PullInResult:
    """Pull-in and release voltage of a gap."""

    port: str
    """Port whose voltage was varied."""
    pull_in_v: float
    """Pull-in voltage: limit point at rising voltage [V]."""
    release_v: float | None
    """Release voltage, at which the last closed gap opens [V]; None if it stays closed."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh [1]; None without an estimate."""
    held: bool = True
    """False if no contact holds the part beyond pull-in."""
    warnings: tuple[str, ...] = ()
    """Warnings about the result."""
    snaps_v: tuple[float, ...] = ()
    """Voltages between pull-in and the highest one searched at which the closed part snaps further [V]; ``release_v`` is that beyond the last."""
    release_before_snaps_v: float | None = None
    """Release voltage from the state to which pull-in itself leads [V]; None if the part does not snap further, or stays closed."""

    def to_pandas(self) -> pandas.DataFrame:
        """One row, by port; ``attrs["units"]`` has the units."""
        columns = self._columns()
        return showing.frame(columns, ("port", [self.port]), dict.fromkeys(columns, "V"))

    def to_xarray(self) -> xarray.Dataset:
        """The numbers of :meth:`to_pandas`, and ``snaps_v`` by number of the snap, each with its unit in ``attrs["units"]``."""
        columns = self._columns()
        about = {"estimated_error": self.estimated_error, "held": int(self.held)}
        found = labelled.dataset(("port", [self.port], ""), columns, dict.fromkeys(columns, "V"), about)
        return found.assign(snaps_v=("snap", np.array(self.snaps_v, dtype=np.float64), {"units": "V"}))

    def _columns(self) -> dict[str, list[float]]:
        voltages = {"pull_in_v": self.pull_in_v, "release_v": self.release_v, "release_before_snaps_v": self.release_before_snaps_v}
        return {name: [math.nan if volts is None else volts] for name, volts in voltages.items()}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the state of the gap at rising and at falling voltage."""
        return plots.pull_in(self, ax)

    def _repr_html_(self) -> str:
        snaps = [f"snaps further at {volts:.6g} V" for volts in self.snaps_v]
        note = showing.note(self.estimated_error, [*snaps, *self.warnings])
        return showing.table(["port", "pull-in [V]", "release [V]"], [(self.port, self.pull_in_v, self.release_v)], note)


@dataclass(frozen=True)
class Crossing:
    """A signal that crosses a level, or a gap that closes or opens."""

    signal: str
    """Name of the signal; of a gap, its ``GAP.gap``."""
    level: float
    """Level, in the unit of the signal."""
    t: float
    """Time [s]."""
    up: bool
    """Whether the signal crosses from below."""
    contact: bool
    """Whether a contact force begins (``up`` False) or ends (``up`` True) to act."""


@dataclass(frozen=True)
class Statistics:
    """Statistics of a signal over the part of a run whose single samples are not reliable."""

    signal: str
    """Name of the signal."""
    start: float
    """Start of that part [s]."""
    stop: float
    """End of that part [s]."""
    mean: float
    """Mean, in the signal's unit."""
    mean_error: float
    """Half width of the 95 % confidence interval of the mean."""
    rms: float
    """Standard deviation (root mean square about the mean)."""
    low: float
    """Lowest sample."""
    high: float
    """Highest sample."""


@dataclass(frozen=True, eq=False, repr=False)
class TransientResult:
    """Sampled signals of a transient."""

    t: NDArray[np.float64]
    """Times [s]."""
    signals: dict[str, NDArray[np.float64]]
    """Samples of each signal, in its unit."""
    units: dict[str, str]
    """Unit of each signal."""
    steps: int
    """Accepted steps."""
    rejected: int
    """Rejected steps."""
    unknowns: int
    """Mechanical unknowns."""
    estimated_error: float | None = None
    """Largest estimated relative error by the mesh [1]; None without an estimate."""
    warnings: tuple[str, ...] = ()
    """Warnings about the result."""
    step_error: float | None = None
    """Estimated root mean square error by the time steps, of the worst signal, relative to its amplitude [1]; None without an estimate."""
    stopped_at: float | None = None
    """Time at which ``until`` ended the run [s]; None if it did not."""
    reliable_until: float | None = None
    """In a run with contacts, time up to which samples meet the tolerance [s]; None if all do."""
    after_contact: tuple[Statistics, ...] = ()
    """Statistics of each signal after ``reliable_until``."""
    events: tuple[Crossing, ...] = ()
    """Crossings of ``events``, and contacts of gaps that begin and end, in order of time."""
    formulation_taken: str | None = None
    """Formulation that ``auto`` took, with the reason; None where another was requested."""

    def __repr__(self) -> str:
        names = ", ".join(f"{name} [{unit}]" for name, unit in self.units.items())
        return f"<TransientResult of {names}: {len(self.t)} times to {self.t[-1] if len(self.t) else 0.0:g} s>"

    def to_pandas(self) -> pandas.DataFrame:
        """A column for each signal, by time [s]; ``attrs["units"]`` has the units."""
        return showing.frame(self.signals, ("t", self.t), {"t": "s", **self.units})

    def to_xarray(self) -> xarray.Dataset:
        """The signals of :meth:`to_pandas`, each with its unit in ``attrs["units"]``."""
        about = {"estimated_error": self.estimated_error, "step_error": self.step_error, "reliable_until": self.reliable_until}
        return labelled.dataset(("t", self.t, "s"), self.signals, self.units, about)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws every signal over time, in its unit."""
        return plots.over_time(self.t, self.signals, self.units, ax)

    def _repr_html_(self) -> str:
        head = ["t [s]", *(f"{name} [{unit}]" for name, unit in self.units.items())]
        rows = zip(self.t.tolist(), *(values.tolist() for values in self.signals.values()))
        return showing.table(head, rows, showing.note(self.estimated_error, self.warnings))
