"""A compiled netlist, and its analyses."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from . import arguments, exports, paths
from .aloud import issue, of_mesh
from .channel import Channel
from .errors import Diagnostic, InvalidRequest, NotFound, Unavailable, shown
from .events import Until, crossing, events_to_wire, statistics, until_to_wire
from .exports import ExportResult, Language, Scales
from .messages import Voltages, by_name, diagnostic, estimate_of, named, setting_value
from .naming import by_argument, each
from .paths import Branch, PathResult
from .response import SPACINGS, response_of
from .results import AnchorForce, FrequencyResponse, ModeLoss, ModesResult, NodeMotion, PullInResult, StabilityLoss, StaticResult, TransientResult
from .session import Session, opened_just_now
from .stopping import apart
from .ticket import Snapshot
from .together import together
from .v1 import analysis_pb2, device_pb2, model_pb2
from .verified import Checked
from .viewing import view_of
from .waveforms import Waveform, checked, drive, with_error_estimate

METHODS = ("rodas4", "avf", "midpoint", "tr-bdf2", "generalized-alpha", "newmark", "radau5", "rk45", "sdirk4")
"""Integrators of a transient."""
Method = Literal["rodas4", "avf", "midpoint", "tr-bdf2", "generalized-alpha", "newmark", "radau5", "rk45", "sdirk4"]


class Model:
    """A compiled netlist on a server, opened with :meth:`Client.compile`.

    It can be sent to worker processes. If the server has released it or was restarted, the netlist is compiled again.
    """

    def __init__(self, channel: Channel, description: Any, source: Any) -> None:
        checked = Checked(channel.address, "compile")
        checked.names("id of the model", [description.id])
        checked.names("ports", description.ports)
        checked.names("nodes", description.nodes)
        self._channel = channel
        self._description = description
        self._source = source
        self.id: str = description.id
        """Hash of netlist and options."""
        self.ports: tuple[str, ...] = tuple(description.ports)
        """Ports, in netlist order."""
        self.nodes: tuple[str, ...] = tuple(description.nodes)
        """Mechanical nodes. Signals are ``NODE.x`` [m], ``NODE.y`` [m], ``NODE.rz`` [rad], and their rates."""
        self.unknowns: int = description.unknowns
        """Mechanical unknowns."""
        self.parameters: dict[str, float | str] = {p.name: setting_value(p) for p in description.parameters}
        """Netlist parameters and their values [SI]."""
        self.warnings: tuple[Diagnostic, ...] = tuple(diagnostic(d) for d in description.warnings)
        """Warnings of the netlist and of the mesh of sessions (W040)."""

    def __getstate__(self) -> dict[str, Any]:
        description, source = self._description.SerializeToString(), self._source.SerializeToString()
        return {"channel": self._channel, "description": description, "source": source}

    def __setstate__(self, state: dict[str, Any]) -> None:
        description = model_pb2.ModelDescription.FromString(state["description"])
        source = model_pb2.CompileRequest.FromString(state["source"])
        self.__init__(state["channel"], description, source)  # type: ignore[misc]

    def _call(self, method: str, request: Any) -> Any:
        """A call for this model. The netlist is compiled again if the server has released the model."""
        with by_argument(method):
            try:
                return self._channel.call(method, request)
            except NotFound:
                self._channel.call("Compile", self._source)
                return self._channel.call(method, request)

    def _checked(self, call: str) -> Checked:
        return Checked(self._channel.address, f"{call} of model {self.id[:8]}")

    def _tol(self) -> float:
        """Tolerance of the model [1]."""
        options = self._source.options
        return float(options.tol) if options.HasField("tol") else 1e-3

    def _finer(self) -> Model:
        """The same netlist with a tenth of the tolerance on a finer mesh, or on twice the segments."""
        source = model_pb2.CompileRequest()
        source.CopyFrom(self._source)
        source.options.tol = 0.1 * self._tol()
        if source.options.HasField("segments"):
            source.options.segments = 2 * source.options.segments
        return Model(self._channel, self._channel.call("Compile", source).model, source)

    def __repr__(self) -> str:
        return f"Model({self.id[:8]}…, ports={list(self.ports)}, {self.unknowns} unknowns)"

    def view(self, voltages: Voltages | None = None, *, height: int = 720) -> Any:
        """The live bench of the model as a widget of a notebook, ``height`` pixels high: the mechanism moves while its parameters are turned.

        ``voltages`` are those of the ports to begin with [V]. It needs anywidget. The analyses run in a process ``bimorph view`` beside the kernel,
        with the netlist and the options of this model; the ``close()`` of the widget ends it.
        """
        return view_of(self._source, arguments.volts("voltages", voltages), arguments.integer("height", height, 200, 4000))

    def static(self, voltages: Voltages | None = None, *, backbend: Voltages | None = None) -> StaticResult:
        """Static equilibrium at these port voltages [V], followed from rest. ``NODE.ux``, ``.uy`` [m] and ``.urz`` [rad] in place of a port move a driven anchor.

        ``backbend`` are voltages [V] to which ports are raised once before, so that hot arms with a ``yieldstress`` yield and stay shorter; the
        ``permanent_strains`` of the result are those of the arms.
        """
        request = analysis_pb2.StaticRequest(model=self.id, voltages=named(voltages), backbend=named(backbend, "backbend"))
        answer = self._call("Static", request)
        self._checked("static").static(answer)
        return StaticResult(
            nodes={n.name: NodeMotion(n.x, n.y, n.rz) for n in answer.nodes},
            temperatures_k=by_name(answer.temperatures_k),
            peak_temperatures_k=by_name(answer.peak_temperatures_k),
            currents_a=by_name(answer.currents_a),
            charges_c=by_name(answer.charges_c),
            pulled_in=answer.pulled_in,
            unknowns=answer.unknowns,
            iterations=answer.iterations,
            estimated_error=estimate_of(answer),
            jumped=answer.jumped,
            warnings=issue(answer.warnings),
            free_motions=tuple(answer.free_motions),
            passed=tuple(_loss(one) for one in answer.passed),
            permanent_strains=by_name(answer.permanent_strains),
            stresses_pa=by_name(answer.stresses_pa),
            nominal_stresses_pa=by_name(answer.nominal_stresses_pa),
            anchor_forces={one.name: AnchorForce(one.fx, one.fy, one.m) for one in answer.anchor_forces},
        )

    def modes(self, count: int = 6, voltages: Voltages | None = None, quality: bool = False) -> ModesResult:
        """The ``count`` lowest modes about the equilibrium at these port voltages [V]. With ``quality`` the result has their losses by cause."""
        request = analysis_pb2.ModesRequest(
            model=self.id,
            count=arguments.integer("count", count, 1),
            voltages=named(voltages),
            quality=arguments.flag("quality", quality),
        )
        answer = self._call("Modes", request)
        self._checked("modes").modes(answer)
        shapes = [
            {name: NodeMotion(x, y, rz) for name, x, y, rz in zip(answer.nodes, s.x, s.y, s.rz)}
            for s in answer.shapes
        ]
        return ModesResult(
            list(answer.frequencies_hz),
            list(answer.residuals),
            shapes,
            answer.unknowns,
            [None if math.isnan(e) else e for e in answer.errors],
            answer.deflection_m,
            issue(answer.warnings),
            estimate_of(answer),
            tuple(ModeLoss(loss.frequency_hz, loss.drag, loss.gas, loss.thermoelastic, loss.electrical, loss.anchors) for loss in answer.losses),
        )

    def ac(
        self,
        drive: str,
        signals: Sequence[str] = (),
        *,
        start: float,
        stop: float,
        points: int = 201,
        spacing: Literal["log", "decade", "linear"] = "log",
        even: bool = False,
        by_modes: bool = False,
        modes: int = 0,
        voltages: Voltages | None = None,
    ) -> FrequencyResponse:
        """Small-signal frequency response from ``start`` to ``stop`` [Hz], about the equilibrium at these port voltages [V].

        ``drive`` is ``NODE.fx``, ``NODE.fy`` [N], ``NODE.m`` [N·m], ``NODE.ux``, ``.uy`` [m] or ``.urz`` [rad] of a driven anchor, a port [V], ``BEAM.T`` (heat) [W], ``frame.ax``, ``frame.ay`` [m/s²]
        or ``frame.wz`` [rad/s]. ``signals`` are those of nodes, beams and gaps, and ``PORT.i``, the current into a port [A]; the default
        is the driving-point response. ``points`` is the number of frequencies with equal quotients (``"log"``) or equal differences (``"linear"``),
        or their number in each ``"decade"``. Points are added near resonances and zeros unless ``even``. ``by_modes`` selects modal superposition
        with static correction, of the ``modes`` lowest modes or, with 0, of those up to twice ``stop``. Otherwise each frequency is solved exactly.
        """
        start = arguments.number("start", start, "a frequency in Hz", above=0.0)
        stop = arguments.number("stop", stop, f"a frequency in Hz from start, {start:g}, on", least=start)
        request = analysis_pb2.FrequencyResponseRequest(
            model=self.id,
            drive=arguments.text("drive", drive, "the name of a drive"),
            signals=arguments.names("signals", signals),
            from_hz=start,
            to_hz=stop,
            points=arguments.integer("points", points, 1),
            spacing=SPACINGS[arguments.choice("spacing", spacing, SPACINGS)],
            even=arguments.flag("even", even),
            by_modes=arguments.flag("by_modes", by_modes),
            modes=arguments.integer("modes", modes),
            voltages=named(voltages),
        )
        answer = self._call("FrequencyResponse", request)
        self._checked("ac").response(answer, request.signals)
        issue(answer.warnings)
        return response_of(answer, drive)

    def pull_in(self, max_v: float = 200.0, port: str = "") -> PullInResult:
        """Pull-in and release voltage [V] of ``port`` (default: the first), searched up to ``max_v`` [V]."""
        port = arguments.text("port", port, "the name of a port", empty=True)
        max_v = arguments.number("max_v", max_v, "a voltage", above=0.0)
        request = analysis_pb2.PullInRequest(model=self.id, port=port, max_v=max_v)
        answer = self._call("PullIn", request)
        self._checked("pull_in").pull_in(answer)
        return PullInResult(
            port=answer.port,
            pull_in_v=answer.pull_in_v,
            release_v=answer.release_v if answer.HasField("release_v") else None,
            estimated_error=estimate_of(answer),
            held=not answer.unheld,
            warnings=issue(answer.warnings),
            snaps_v=tuple(answer.snaps_v),
            release_before_snaps_v=answer.release_before_snaps_v if answer.HasField("release_before_snaps_v") else None,
        )

    def path(
        self,
        along: str,
        start: float,
        stop: float,
        signals: Sequence[str] = (),
        *,
        branch: Branch = "plus",
        points: int = 2000,
        voltages: Voltages | None = None,
    ) -> PathResult:
        """Equilibria while a parameter goes from ``start`` to ``stop``, past limit points and through bifurcations.

        ``along`` is a port [V], a parameter of the netlist that sets loads, temperatures or stresses, or ``"loads"``, the factor on all dead loads.
        The path starts at the equilibrium at ``start``. Where it loses its stability at a bifurcation it follows the branch along the buckling
        shape (``"plus"``), against it (``"minus"``), or goes straight on (``"stay"``). ``signals`` are those of nodes, beams and gaps; the default is x and y
        of the node that moves most. ``points`` is the largest number of points, and ``voltages`` are those of other ports [V].
        """
        request = paths.request_of(self.id, along, (start, stop), signals, branch, points, voltages)
        answer = self._call("Path", request)
        self._checked("path").path(answer, request.signals)
        issue(answer.warnings)
        return paths.path_of(answer, along)

    def export(
        self,
        language: Language = "spice",
        *,
        ports: Scales = (),
        signals: Scales = (),
        voltages: Voltages | None = None,
        to: float | None = None,
        within: float | None = None,
        count: int | None = None,
        name: str | None = None,
        nonlinear: bool = False,
        ranges: Mapping[str, tuple[float, float]] | None = None,
    ) -> ExportResult:
        """The model as text for other simulators: a SPICE subcircuit or a Verilog-A module, as ``bimorph export`` writes it.

        By default it is the linear model about the equilibrium at ``voltages`` [V]. It deviates by at most ``within`` (1e-4) from the exact small-signal
        response up to the frequency ``to`` [Hz], by default that of the second mode that ports and signals see. It has as many modes as that
        requires, or exactly the ``count`` lowest. ``nonlinear`` is the whole model of rigid parts that only slide on linear springs, without an
        operating point. Of flexible parts it is a reduced one for the ``ranges`` of ports, as ``{"drive": (0, 20)}`` in V, N or W. Its equilibria there
        deviate by at most ``within`` (1e-3) from the full model, or a warning says by how much.

        ``ports`` are those of the file in its order, by default all of the netlist: ``NODE.x``, ``NODE.vx``, ``BEAM.T`` and ``frame.ax`` too.
        ``signals`` are shown as voltages. Both are names, or names with a scale in volts per unit, as ``{"yoke.y": 1e6}``. ``name`` is that of
        the subcircuit or module.
        """
        request = exports.request_of(self.id, language, ports, signals, voltages, to, within, count, name, nonlinear, ranges)
        answer = self._call("Export", request)
        self._checked("export").export(answer)
        issue(answer.warnings)
        return exports.export_of(answer, language)

    def transient(
        self,
        stop: float,
        signals: Sequence[str],
        *,
        points: int = 1001,
        tol: float = 0.0,
        voltages: Voltages | None = None,
        inputs: Mapping[str, Waveform] | None = None,
        estimate: bool = True,
        release: Model | None = None,
        until: Until | None = None,
        events: Sequence[tuple[str, float]] = (),
        method: Method | None = None,
        rho: float | None = None,
        step: float | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> TransientResult:
        """Motion from 0 to ``stop`` [s] at constant port voltages [V], at ``points`` equally spaced times.

        ``signals`` are those of nodes (``m.x``, ``m.vx``), beams (``b.T``) and gaps (``g.gap``, ``g.q``), and of ports the charge ``PORT.q`` [C] and the
        current ``PORT.i`` [A], which runs along ``inputs`` do not have.

        ``release`` is a variant of the same netlist, whose static equilibrium is the initial state. By default the initial state is the undeformed
        model at rest. ``tol`` is the relative tolerance of a step [1], by default (0) that of the model; the mesh meets the smaller of the two.
        ``until`` ends the run at an event: ``"contact"`` where parts begin to touch, ``"release"`` where they separate,
        ``("yoke.y", -1e-6)`` where a signal crosses a level in its unit. ``events`` are such pairs that do not end the run. The ``events`` of the
        result have the times of all crossings and contacts. ``progress`` is called with the fraction done.

        ``method`` is the integrator, by default ``"rodas4"``, and ``rho`` the spectral radius of ``"generalized-alpha"`` at infinite frequency.
        With ``step`` [s] all steps have this length and do not follow ``tol``.

        ``inputs`` are piecewise linear waveforms of ports, ``{"heat": (times, volts)}`` or ``{"b.uy": (times, metres)}`` of a driven anchor, constant before
        and after. The run then begins in the static equilibrium at time 0, and steps end at every corner. The error estimate comes from a second run on a finer mesh with a tenth of the
        tolerance, which runs at the same time and takes several times as long. ``estimate=False`` omits it.
        """
        stop = arguments.number("stop", stop, "a time in seconds", above=0.0)
        signals = arguments.names("signals", signals)
        if not signals:
            raise arguments.wrong("signals", "at least one signal", signals)
        points = arguments.integer("points", points, 2)
        tol = arguments.number("tol", tol, "a relative error, or 0 for that of the model,", least=0.0, below=1.0)
        held = arguments.volts("voltages", voltages)
        estimate = arguments.flag("estimate", estimate)
        if release is not None:
            arguments.instance("release", release, Model, "None or a model, as compile() gives it of the netlist with its load")
        crossings = events_to_wire(events)
        integrator = None if method is None else arguments.choice("method", method, METHODS)
        if rho is not None:
            rho = arguments.number("rho", rho, "None or a spectral radius", least=0.0, most=1.0)
            if integrator != "generalized-alpha":
                raise InvalidRequest(f'rho: expected None, as method is not "generalized-alpha", got {rho:g}')
        step = None if step is None else arguments.number("step", step, "None or a time in seconds", above=0.0)
        arguments.function("progress", progress)
        if inputs is not None:
            excluded = {"until": until, "release": release, "tol": tol or None, "events": crossings or None, "method": integrator, "step": step}
            for name, given in excluded.items():
                if given is not None:
                    why = "a run along inputs lasts to stop, and begins in the equilibrium of its inputs, with the tolerance of the model"
                    raise InvalidRequest(f"{name}: expected none together with inputs, got {arguments.shown(given)}; {why}")
            waves: dict[str, Waveform] = {**{port: ([0.0], [volts]) for port, volts in held.items()}, **checked(inputs)}
            # ports of nodes, beams, anchors and the frame exist where a session names them
            ports = tuple(waves) if any("." in port for port in waves) else ()

            def driven(model: Model, progress: Callable[[float], object] | None = None) -> TransientResult:
                with model._session(signals, ports) as session:
                    return drive(session, waves, stop, points, progress)

            if estimate:
                found, finer = together(lambda: driven(self, progress), lambda: driven(self._finer()))
                found = with_error_estimate(found, finer, self._tol())
            else:
                found = with_error_estimate(driven(self, progress), None, self._tol())
            issue(found.warnings)
            return found
        request = analysis_pb2.TransientRequest(
            model=self.id,
            stop_s=stop,
            signals=signals,
            points=points,
            tol=tol,
            voltages=named(voltages),
            release_model=release.id if release else "",
            until=until_to_wire(until),
            events=crossings,
            method=integrator or "",
            rho=rho,
            step_s=step or 0.0,
        )
        for model in (self, release):
            if model is not None:
                model._describe()
        t: list[float] = []
        columns: list[list[float]] = [[] for _ in signals]
        replies = self._checked("transient")
        levels = [("until", until[0])] if isinstance(until, tuple) else []
        levels += [(f"events[{k}]", one.name) for k, one in enumerate(crossings)]
        crossed = [(re.escape(f'signal "{signal}"'), name) for name, signal in levels if signal not in signals]
        for event in each("Transient", self._channel.stream("Transient", request), *crossed):
            if progress is not None:
                progress(event.progress)
            if event.HasField("samples"):
                replies.samples(event.samples, t[-1] if t else -math.inf, len(columns))
                t.extend(event.samples.t)
                for column, more in zip(columns, event.samples.signals):
                    column.extend(more.values)
            if event.HasField("finished"):
                end = event.finished
                curves = {name: np.array(column) for name, column in zip(signals, columns)}
                units = dict(zip(signals, end.units))
                work = (end.steps, end.rejected, end.unknowns)
                return TransientResult(
                    np.array(t),
                    curves,
                    units,
                    *work,
                    estimated_error=estimate_of(end),
                    warnings=issue(end.warnings),
                    step_error=end.step_error if end.HasField("step_error") else None,
                    stopped_at=end.stopped_at if end.HasField("stopped_at") else None,
                    reliable_until=end.reliable_until if end.HasField("reliable_until") else None,
                    after_contact=tuple(statistics(one) for one in end.after_contact),
                    events=tuple(crossing(one) for one in end.events),
                    formulation_taken=end.formulation_taken if end.HasField("formulation_taken") else None,
                )
        raise Unavailable(f"server {self._channel.address}: the stream ended before the run did")

    def session(
        self,
        signals: Sequence[str] = (),
        ports: Sequence[str] = (),
        timeout: float = 60.0,
        *,
        seed: int | None = None,
        noise_band: float | None = None,
        kept: bool = False,
    ) -> Session:
        """Opens a session of this model; use it in a ``with`` block.

        Every reply has the values of ``signals``. ``ports`` selects ports and their order. They are ports of the netlist; ``NODE.x``, ``.y`` and ``.rz``
        (input force or moment, response displacement); ``NODE.vx``, ``.vy`` and ``.vrz`` (response velocity); ``BEAM.T`` (input heat, response
        temperature rise); ``NODE.ux``, ``.uy`` and ``.urz`` of a driven anchor (input displacement or rotation, response force or moment);
        ``frame.ax``, ``.ay`` and ``.wz`` (acceleration and angular rate of the frame). Omitted electrical ports are at 0 V, other
        ones are free. ``timeout`` [s] bounds each call.

        With a ``seed``, the thermal noise of gas and dampers acts as a random force in every step; equal seeds give equal forces. ``noise_band`` [Hz] is
        the band of the force, by default twenty times the lowest natural frequency. Steps are then divided into pieces of at most two cells of
        1/(2·band).

        A ``kept`` session survives the loss of its connection for a time (:meth:`Session.resume`). It survives the server too if that stores states
        (``bimorph serve --state-dir``).
        """
        of_mesh(self.warnings)
        return self._session(signals, ports, timeout, seed, noise_band, kept)

    def _session(
        self,
        signals: Sequence[str],
        ports: Sequence[str] = (),
        timeout: float = 60.0,
        seed: int | None = None,
        noise_band: float | None = None,
        kept: bool = False,
    ) -> Session:
        """As :meth:`session`, without warnings."""
        signals, ports = tuple(arguments.names("signals", signals)), tuple(arguments.names("ports", ports))
        timeout, kept = arguments.timeout("timeout", timeout), arguments.flag("kept", kept)
        seed = None if seed is None else arguments.integer("seed", seed, 0, (1 << 64) - 1)
        if noise_band is not None:
            noise_band = arguments.number("noise_band", noise_band, "None or a band in Hz", above=0.0)
            if seed is None:
                raise InvalidRequest(f"noise_band: expected a seed together with it, got noise_band={noise_band:g} alone")
        self._describe()
        noise = None if seed is None else device_pb2.Agitation(seed=seed, band_hz=noise_band)
        if kept:
            with apart():
                opened = self._call("Open", device_pb2.OpenRequest(model=self.id, ports=ports, signals=signals, noise=noise))
            return opened_just_now(self._channel, self.id, timeout, opened.session)
        return Session(self._channel, self.id, ports, signals, timeout, noise=noise)

    def restore(self, snapshot: Snapshot, timeout: float = 60.0) -> Session:
        """Opens a session that continues from a :meth:`Session.snapshot` of this model, with bit-identical results.

        Raises :class:`NoResult` for a snapshot of another model or of another version of the server.
        """
        snapshot = arguments.instance("snapshot", snapshot, Snapshot, "a Snapshot, as Session.snapshot() gives it")
        timeout = arguments.timeout("timeout", timeout)
        request = device_pb2.RestoreRequest(model=self.id, snapshot=snapshot.states)
        with apart():
            opened = self._call("Restore", request)
        session = opened_just_now(self._channel, self.id, timeout, opened.session)
        session.accepted, session.t, session._voltages = snapshot.accepted, snapshot.t, dict(snapshot.voltages)
        return session

    def _describe(self) -> None:
        """Compiles the model again if the server has released it."""
        self._call("Describe", model_pb2.DescribeRequest(model=self.id))


def _loss(wire: Any) -> StabilityLoss:
    """A loss of stability from its message."""
    kind: Literal["limit-point", "bifurcation"] = "bifurcation" if wire.kind == analysis_pb2.PassedLoss.BIFURCATION else "limit-point"
    return StabilityLoss(kind, wire.share, shown(wire.direction))
