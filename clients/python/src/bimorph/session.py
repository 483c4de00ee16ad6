"""A session: one device, stepped over a stream."""

from __future__ import annotations

import contextlib
import itertools
import os
import threading
from collections.abc import Mapping
from dataclasses import replace
from types import TracebackType
from typing import Any

from .aloud import of_states
from .arguments import MAX_STEP, given_to, instance, number, one_of, text
from .channel import Channel
from .errors import BimorphError, Diagnostic, InvalidRequest, NotFound, StepFailed, from_fault, shown
from .local import ADDRESS
from .messages import diagnostic
from .naming import by_argument
from .results import NodeMotion
from .runs import Runs
from .stopping import apart, check
from .ticket import Snapshot, Ticket
from .trial_reply import TrialReply
from .v1 import device_pb2
from .verified import Checked

_SHORTEST = 1e-9
"""Shortest piece of a step, as a fraction of the step; a step that requires shorter ones has failed."""
_PIECES = 4
"""After this number of pieces the accepted state is marked as in use: of a large model the server may hold only eight states."""


class Session(Runs):
    """A device with its states, opened with :meth:`Model.session`; use it in a ``with`` block.

    A trial is a pure function of its parent state, step and voltages: it changes no state, and equal trials give bit-identical
    replies. ``accept`` makes the state of a reply the parent of the next trials; ``step`` does both.

    Threads may share a session: calls run one after the other. A call that fails or is interrupted (Ctrl-C, a timeout of a test runner)
    leaves the accepted state unchanged, and the next call gets its own reply.
    """

    def __init__(
        self,
        channel: Channel,
        model: str,
        ports: tuple[str, ...],
        signals: tuple[str, ...],
        timeout: float,
        session: str = "",
        noise: device_pb2.Agitation | None = None,
    ) -> None:
        """Opens a session, or attaches to the open ``session`` of the server and closes that at its end."""
        self._channel = channel
        self._model = model
        self._session = session
        self._joined = bool(session)
        self._closed = False
        self._timeout = timeout
        self._pid = os.getpid()
        # Held for a whole step.
        self._lock = threading.RLock()
        self._line = channel.line(timeout)
        self.t = 0.0
        """Time of the accepted state [s]."""
        self.accepted: TrialReply | None = None
        """The accepted state; None: the model at rest as drawn."""
        self._voltages: dict[str, float] = {}
        self._checked = Checked(channel.address, f"session of model {model[:8]}")
        self._last: tuple[int, object] | None = None
        self._warnings: list[Diagnostic] = []
        self._issued = 0
        # Token of an accepted state whose warnings come with the next reply.
        self._due = 0
        if session:
            first = device_pb2.DeviceRequest(attach=device_pb2.Attach(session=session))
        else:
            first = device_pb2.DeviceRequest(
                open=device_pb2.OpenRequest(model=model, ports=ports, signals=signals, noise=noise)
            )
        try:
            with by_argument("Open"):
                opened = self._checked.kind(self._ask(first), "opened")
            self._checked.opened(opened.device, ports, None if session else signals)
        except BaseException:
            # do not close a session that this object has not opened
            self.leave()
            raise
        self._session = opened.session
        self.ports: tuple[str, ...] = tuple(opened.device.ports)
        """Names of the ports, in order."""
        kinds = [_kind(k) for k in opened.device.port_kinds] or ["electrical"] * len(self.ports)
        self.port_kinds: dict[str, str] = dict(zip(self.ports, kinds))
        """Kind of each port with the units of input and response: "electrical" (V; A), "force" (N; m), "moment" (N·m; rad), "force_rate"
        (N; m/s), "moment_rate" (N·m; rad/s), "thermal" (W; K above ambient), "acceleration" (m/s²; 0), "rate" (rad/s; 0),
        "displacement" (m; N), "rotation" (rad; N·m)."""
        self.signals: dict[str, str] = {s.name: s.unit for s in opened.device.signals}
        """Opened signals and their units."""
        self.kept: bool = opened.kept
        """Whether the server stores accepted states, which then survive its restart."""
        self.unknowns: int = opened.device.unknowns
        """Mechanical unknowns."""
        self._voltages = dict.fromkeys(self.ports, 0.0)

    def trial(
        self, voltages: Mapping[str, float], dt: float | None = None, *, parent: TrialReply | None = None
    ) -> TrialReply:
        """Reply of the device at these port voltages [V], or inputs of ports of other kinds. Ports that are not named
        keep their values in the accepted state.

        With ``dt`` [s] the reply has the state after a step of that length, along which the voltages change linearly to these. Without, it has the
        static equilibrium. ``parent`` is the state to start from, by default the accepted one. A reply with ``need_dt`` requires a shorter
        step.
        """
        if dt is not None:
            dt = number("dt", dt, "None or a time in seconds", above=0.0, most=MAX_STEP)
        if parent is not None:
            instance("parent", parent, TrialReply, "a TrialReply of this session or None")
        with self._lock:
            return self._try(self._vector(voltages), dt, parent or self.accepted)

    def _try(self, vector: list[float], dt: float | None, parent: TrialReply | None) -> TrialReply:
        check()
        if dt is None:
            mode, t = device_pb2.MODE_STATIC, self.t
        else:
            mode, t = device_pb2.MODE_TRANSIENT, (parent.t if parent else 0.0) + dt
        token = parent.token if parent else 0
        trial = device_pb2.TrialRequest(mode=mode, parent=token, t=t, dt=dt or 0.0, voltages=vector)
        wire = self._checked.kind(self._ask(device_pb2.DeviceRequest(trial=trial)), "trial")
        self._checked.trial(wire, len(self.ports), len(self.signals), dt)
        if wire.token:
            # a token belongs to one trial
            asked = (mode, token, dt, tuple(vector))
            other = self._last is not None and self._last[0] == wire.token and self._last[1] != asked
            self._checked.require(not other, "it names the state of an earlier trial")
            self._last = (wire.token, asked)
        return self._named(wire, t, vector)

    def accept(self, reply: TrialReply, voltages: Mapping[str, float] | None = None) -> None:
        """Makes the state of a reply the accepted one, from which later trials start. ``voltages`` replaces port values of the reply, which
        ports that are not named keep later.

        In a kept session the state is stored on the server when this returns. If this raises, the state before is still accepted, and the
        same trial gives the same state again."""
        instance("reply", reply, TrialReply, "a TrialReply of this session")
        if reply.need_dt is not None:
            raise InvalidRequest("reply: expected one with a state, got one that needs a shorter step")
        with self._lock:
            held = {**reply.voltages, **({} if voltages is None else given_to(self._voltages, voltages))}
            self._accept(reply, dict(zip(self.ports, self._vector(held))))
            self._issue()

    def _accept(self, reply: TrialReply, voltages: dict[str, float]) -> None:
        if self.kept:
            # On the server first, with a reply: it stores the state before as well.
            self._report_accepted(reply)
            self.accepted, self.t, self._voltages = reply, reply.t, voltages
            return
        # Here first: the server only frees memory, and an interrupt must not leave the two in different states.
        self.accepted, self.t, self._voltages = reply, reply.t, voltages
        self._report_accepted(reply)

    def _report_accepted(self, reply: TrialReply, *, warn: bool = True) -> None:
        """``warn``: the warnings of the state come with the next reply."""
        if self.kept:
            self._ask_to_accept(reply.token, warn=warn)
            return
        self._own()
        self._line.send(device_pb2.DeviceRequest(accept=device_pb2.Accept(token=reply.token, warn=warn)))
        self._due = reply.token if warn else self._due

    def _ask_to_accept(self, token: int, *, warn: bool) -> None:
        """Accepts a state and waits until the server has."""
        accept = device_pb2.Accept(token=token, answer=True, warn=warn)
        accepted = self._checked.kind(self._ask(device_pb2.DeviceRequest(accept=accept)), "accepted")
        self._checked.require(accepted.token == token, "it accepts another state than that of the request")

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Warnings of the accepted states since this object was opened, with code, message and remedy: an error of the mesh above the tolerance
        (W040), a reduced model with an error above it or one that the full model has replaced (W053), and others. Each kind is there once, and again
        where it is ten times larger.

        Those of a state come with the reply to the next call, or when this is read. Calls that accept a state issue them as
        :class:`AccuracyWarning`.
        """
        with self._lock:
            if self._due and not self._closed and self._line.over is None:
                with contextlib.suppress(BimorphError):
                    self._ask_to_accept(self._due, warn=False)
            return tuple(self._warnings)

    def _issue(self, level: int = 4, about: str = "") -> None:
        """Issues the warnings received since the last call, located ``level`` calls above."""
        new, self._issued = self._warnings[self._issued :], len(self._warnings)
        of_states(new, level, about)

    def operating_point(self, voltages: Mapping[str, float]) -> TrialReply:
        """Accepts the static equilibrium at these port voltages [V] and sets the time to 0 s.

        Ports that are not named keep their values. The equilibrium is followed from the accepted state, or from the model at rest: between release
        and pull-in a part that is closed stays closed, and ``jumped`` of the reply is True where it passed a limit point.

        Raises :class:`StepFailed` where none is found; the session keeps its state.
        """
        with self._lock:
            reply = self._operating_point(voltages)
            self._issue()
            return reply

    def _operating_point(self, voltages: Mapping[str, float]) -> TrialReply:
        reply = replace(self.trial(voltages), t=0.0)
        self._accept(reply, dict(reply.voltages))
        return reply

    def step(self, voltages: Mapping[str, float], dt: float) -> TrialReply:
        """Takes a step of ``dt`` [s], along which the voltages [V] change linearly to these, in as many pieces as the device requires. If this
        raises, the accepted state is unchanged."""
        with self._lock:
            reply = self._step(voltages, number("dt", dt, "a time in seconds", above=0.0, most=MAX_STEP))
            self._issue()
            return reply

    def _step(self, voltages: Mapping[str, float], dt: float) -> TrialReply:
        start, end = [self._voltages[port] for port in self.ports], self._vector(voltages)
        done, h = 0.0, 1.0
        parent, taken = self.accepted, 0
        while True:
            last = done + h >= 1.0
            h = 1.0 - done if last else h
            mix = end if last else [a + (b - a) * (done + h) for a, b in zip(start, end)]
            reply = self._try(mix, h * dt, parent)
            if reply.need_dt is None:
                if last:
                    self._accept(reply, dict(reply.voltages))
                    return reply
                parent, done, taken = reply, done + h, taken + 1
                if taken % _PIECES == 0 and self.accepted is not None:
                    self._report_accepted(self.accepted, warn=False)
                continue
            h = min(reply.need_dt / dt, h / 2)
            if h < _SHORTEST:
                at = parent.t if parent else 0.0
                raise StepFailed(f"the device requires steps below {h * dt:.3g} s at t = {at:.6g} s")

    def linearize(self, omega: float, reply: TrialReply | None = None) -> dict[str, dict[str, complex]]:
        """Port admittances [S] at angular frequency ``omega`` [rad/s] about a state, by default the accepted one."""
        answer = self._small_signal(omega, reply, noise=False)
        values = [complex(re, im) for re, im in zip(answer.admittance_re, answer.admittance_im)]
        return _matrix(self.ports, self.ports, values)

    def noise(self, omega: float, reply: TrialReply | None = None) -> dict[str, dict[str, complex]]:
        """One-sided spectral densities and cross-spectra of port responses and signals at angular frequency ``omega`` [rad/s] about a
        state, by default the accepted one. The inputs of all ports are constant: the current of a port at constant voltage [A²/Hz], or the
        displacement ``NODE.x`` [m²/Hz]."""
        answer = self._small_signal(omega, reply, noise=True)
        if answer.admittance_re:
            raise BimorphError("the server is of an earlier version without noise analysis; update it")
        values = [complex(re, im) for re, im in zip(answer.noise_re, answer.noise_im)]
        names = (*self.ports, *self.signals)
        return _matrix(names, names, values)

    def _small_signal(self, omega: float, reply: TrialReply | None, *, noise: bool) -> device_pb2.SmallSignal:
        omega = number("omega", omega, "an angular frequency in rad/s", least=0.0)
        self._open()
        state = self.accepted if reply is None else instance("reply", reply, TrialReply, "a TrialReply of this session or None")
        if state is None:
            raise InvalidRequest("reply: expected a reply, or an accepted state, got neither; call operating_point or step first")
        request = device_pb2.SmallSignalRequest(token=state.token, omega=omega, noise=noise)
        asked = self._ask(device_pb2.DeviceRequest(linearize=request))
        answer: device_pb2.SmallSignal = self._checked.kind(asked, "linearized")
        if not (noise and answer.admittance_re):
            self._checked.small_signal(answer, len(self.ports), len(self.signals), noise=noise)
        return answer

    def read(self, signal: str) -> float:
        """Value of an opened signal in the accepted state, in its unit."""
        if self.accepted is None:
            raise InvalidRequest("signal: expected an accepted state to read it in, got none; call operating_point or step first")
        return self.accepted.outputs[one_of("signal", signal, self.signals, "signals of the session")]

    def motion(self, node: str) -> NodeMotion:
        """Displacement of a node in the accepted state; ``NODE.x``, ``.y`` and ``.rz`` must be among the signals."""
        text("node", node, "the name of a node")
        wanted = [one_of("node", f"{node}.{axis}", self.signals, "signals of the session") for axis in ("x", "y", "rz")]
        return NodeMotion(*map(self.read, wanted))

    def snapshot(self) -> Snapshot:
        """The accepted state as a value, for :meth:`Model.restore` later, in another process or on another server."""
        with self._lock:
            self._open()
            token = self.accepted.token if self.accepted else 0
            request = device_pb2.SnapshotRequest(session=self._session, token=token)
            states = self._channel.call("Snapshot", request).snapshot
            return Snapshot(self._model, states, self.accepted, self.t, dict(self._voltages))

    def fork(self) -> Session:
        """Opens another session with the same states; close it as well."""
        with self._lock:
            self._open()
            with apart():
                opened = self._channel.call("Fork", device_pb2.ForkRequest(session=self._session))
            other = opened_just_now(self._channel, self._model, self._timeout, opened.session)
            other.accepted, other.t, other._voltages = self.accepted, self.t, dict(self._voltages)
            return other

    def ticket(self) -> Ticket:
        """Ticket of this kept session for :meth:`Client.resume`, also in another process."""
        with self._lock:
            if not self._joined:
                self._open()
                raise BimorphError("this session does not outlive its connection; open one with Model.session(kept=True)")
            return Ticket(self._model, self._session, self.accepted, self.t, dict(self._voltages))

    def resume(self) -> Session:
        """Attaches to this kept session over a new connection, after the old one was lost, a call exceeded its timeout, or the server was restarted.
        Retries until the timeout while the server is unavailable. This object is closed, the session is not. If this raises, neither has changed.
        """
        with self._lock:
            ticket = self.ticket()
            other = resumed(self._channel, ticket, self._timeout)
            self.leave()
            return other

    def leave(self) -> None:
        """Ends the stream only: a kept session stays on its server and can be resumed with a :meth:`ticket` taken before."""
        self._joined = False
        self.close()

    def close(self) -> None:
        """Closes the session on the server, with its states. Later calls raise :class:`BimorphError`."""
        if self._pid == os.getpid():
            self._closed = True
            self._line.close(self._ended())
            if self._joined:
                self._joined = False
                with contextlib.suppress(BimorphError), apart():
                    self._channel.call("Close", device_pb2.CloseRequest(session=self._session))

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _vector(self, voltages: Mapping[str, float]) -> list[float]:
        given, held = given_to(self._voltages, voltages), self._voltages
        return [given[port] if port in given else held[port] for port in self.ports]

    def _named(self, wire: Any, t: float, vector: list[float]) -> TrialReply:
        if wire.status == device_pb2.TrialReply.STATUS_FAIL:
            raise StepFailed(shown(wire.reason))
        need = wire.need_dt if wire.status == device_pb2.TrialReply.STATUS_NEED_DT else None
        names = tuple(self.signals)
        return TrialReply(
            token=wire.token,
            t=t,
            currents=dict(zip(self.ports, wire.currents)),
            charges=dict(zip(self.ports, wire.charges)),
            di_dv=_matrix(self.ports, self.ports, wire.di_dv),
            dq_dv=_matrix(self.ports, self.ports, wire.dq_dv),
            outputs=dict(zip(names, wire.outputs)),
            doutputs_dv=_matrix(names, self.ports, wire.doutputs_dv),
            dt_next=wire.dt_next,
            jumped=wire.jumped,
            need_dt=need,
            voltages=dict(zip(self.ports, vector)),
        )

    def _ended(self) -> BimorphError:
        where = "in this process" if self._channel.address == ADDRESS else f"on server {self._channel.address}"
        return BimorphError(f"this session of model {self._model[:8]} {where} is closed; open another one with Model.session()")

    def _open(self) -> None:
        """Raises :class:`BimorphError` where this object was closed."""
        self._own()
        if self._closed:
            raise self._ended()

    def _own(self) -> None:
        if self._pid != os.getpid():
            raise BimorphError("a session does not survive a fork; open one in this process")

    def _usable(self) -> None:
        """Raises the reason why this session cannot be used, if there is one."""
        self._own()
        if self._line.over is not None:
            raise self._line.over

    def _ask(self, request: Any) -> Any:
        with self._lock:
            self._own()
            reply = self._line.ask(request)
            self._due = 0
            self._warnings.extend(map(diagnostic, reply.warnings))
        if reply.WhichOneof("kind") == "fault":
            fault = reply.fault
            kind = fault.WhichOneof("kind")
            if kind == "refused":
                raise from_fault(fault.refused.code, fault.message, self._channel.address)
            raise (NotFound if kind == "unknown_token" else InvalidRequest)(shown(fault.message))
        return reply


def opened_just_now(channel: Channel, model: str, timeout: float, session: str) -> Session:
    """Attaches to a session that was just opened; closes it if that fails."""
    try:
        return Session(channel, model, (), (), timeout, session)
    except BaseException:
        with contextlib.suppress(BimorphError), apart():
            channel.call("Close", device_pb2.CloseRequest(session=session))
        raise


def resumed(channel: Channel, ticket: Ticket, timeout: float) -> Session:
    """The session of a ticket; retries until the timeout while the server is unavailable."""
    session = channel.persist(lambda: Session(channel, ticket.model, (), (), timeout, ticket.session), timeout)
    session.accepted, session.t, session._voltages = ticket.accepted, ticket.t, dict(ticket.voltages)
    return session


def _kind(number: int) -> str:
    return str(device_pb2.PortKind.Name(number)).removeprefix("PORT_KIND_").lower()


def _matrix(rows: tuple[str, ...], columns: tuple[str, ...], values: Any) -> dict[str, dict[str, Any]]:
    flat = iter(values)
    return {row: dict(zip(columns, itertools.islice(flat, len(columns)))) for row in rows}
