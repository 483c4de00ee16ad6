"""Checks of the replies of a server, on receipt: it may be of another version, faulty or hostile. Shapes, kinds, order and numbers must match
the request, and no text may control a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from .errors import UnexpectedReply

_SHORTEST = 1e-12
"""Shortest next step of a reply, as a fraction of the step taken [1]."""


class Checked:
    """Checks of the replies of one server about one session or call."""

    def __init__(self, address: str, about: str) -> None:
        """``about`` names the session or call in errors."""
        self._where = f"server {address}, {about}"

    def require(self, holds: bool, what: str) -> None:
        """Raises :class:`UnexpectedReply` unless ``holds``."""
        if not holds:
            raise UnexpectedReply(
                f"{self._where}: unexpected reply: {what}; the server is faulty, of another version, or none of Bimorph"
            )

    def kind(self, reply: Any, expected: str) -> Any:
        """Checked part of a reply of the given kind."""
        got = reply.WhichOneof("kind")
        self.require(got == expected, f"expected one of kind {expected}, got {got or 'none'}")
        return getattr(reply, expected)

    def numbers(self, what: str, values: Sequence[float], count: int) -> None:
        """Checks the count of numbers, and that all are finite."""
        self.require(len(values) == count, f"{what}: expected {count} numbers, got {len(values)}")
        if not all(map(math.isfinite, values)):
            at = next(k for k, value in enumerate(values) if not math.isfinite(value))
            self.require(False, f"{what}[{at}]: expected a finite number, got {values[at]}")

    def names(self, what: str, names: Iterable[str], asked: Sequence[str] | None = None) -> None:
        """Checks that names have no control characters, and that they are the requested ones in their order."""
        found = list(names)
        for name in found:
            self.require(bool(name) and name.isprintable(), f"{what}: expected a name, got {name!r}")
        if asked:
            self.require(found == list(asked), f"{what}: expected the {len(asked)} of the request, got {len(found)} others")

    def opened(self, device: Any, ports: Sequence[str], signals: Sequence[str] | None) -> None:
        """Checks the description of an opened device; ``signals`` is None if they are unknown."""
        self.names("ports", device.ports, ports)
        self.require(len(device.port_kinds) in (0, len(device.ports)), "port_kinds: expected one for each port")
        self.names("signals", (signal.name for signal in device.signals), signals)
        if signals is not None:
            self.require(len(device.signals) == len(signals), f"signals: expected {len(signals)}, got {len(device.signals)}")

    def trial(self, wire: Any, p: int, s: int, dt: float | None) -> None:
        """Checks the reply to a trial of ``dt`` [s], or None for a static one, of a device with p ports and s signals."""
        if wire.status == wire.STATUS_FAIL:
            return
        if wire.status == wire.STATUS_NEED_DT:
            self.require(
                dt is not None and 0.0 < wire.need_dt < dt,
                f"need_dt: expected less than the step of {dt} s and above 0, got {wire.need_dt}",
            )
            return
        self.require(wire.status == wire.STATUS_OK, f"status: {wire.status} is not known")
        self.require(wire.token != 0, "token: expected one, got 0")
        for what, values, count in (
            ("currents", wire.currents, p),
            ("charges", wire.charges, p),
            ("di_dv", wire.di_dv, p * p),
            ("dq_dv", wire.dq_dv, p * p),
            ("outputs", wire.outputs, s),
            ("doutputs_dv", wire.doutputs_dv, p * s),
        ):
            self.numbers(what, values, count)
        shortest = _SHORTEST * (dt or 0.0)
        self.require(wire.dt_next > shortest, f"dt_next: expected a time above {shortest} s, got {wire.dt_next}")

    def small_signal(self, answer: Any, p: int, s: int, *, noise: bool) -> None:
        """Checks a small-signal reply of a device with p ports and s signals."""
        if noise:
            count = (p + s) ** 2 if answer.noise_re or answer.noise_im else 0
            self.numbers("noise_re", answer.noise_re, count)
            self.numbers("noise_im", answer.noise_im, count)
            return
        for what, values, count in (
            ("admittance_re", answer.admittance_re, p * p),
            ("admittance_im", answer.admittance_im, p * p),
            ("outputs_re", answer.outputs_re, p * s),
            ("outputs_im", answer.outputs_im, p * s),
        ):
            self.numbers(what, values, count)

    def static(self, answer: Any) -> None:
        """Checks a static equilibrium."""
        for node in answer.nodes:
            self.numbers(node.name, (node.x, node.y, node.rz), 3)
        self.names("nodes", (node.name for node in answer.nodes))
        for what, values in (
            ("temperatures_k", answer.temperatures_k),
            ("stresses_pa", answer.stresses_pa),
            ("nominal_stresses_pa", answer.nominal_stresses_pa),
            ("peak_temperatures_k", answer.peak_temperatures_k),
            ("currents_a", answer.currents_a),
            ("charges_c", answer.charges_c),
            ("permanent_strains", answer.permanent_strains),
        ):
            self.names(what, (named.name for named in values))
            self.numbers(what, [named.value for named in values], len(values))
        self.names("anchor_forces", (force.name for force in answer.anchor_forces))
        for force in answer.anchor_forces:
            self.numbers(f"anchor_forces {force.name}", (force.fx, force.fy, force.m), 3)
        self.numbers("passed", [loss.share for loss in answer.passed], len(answer.passed))

    def modes(self, answer: Any) -> None:
        """Checks modes: ascending frequencies, and a shape of each over all nodes."""
        found = answer.frequencies_hz
        self.names("nodes", answer.nodes)
        self.numbers("frequencies_hz", found, len(found))
        in_order = all(a <= b for a, b in zip(found, found[1:])) and all(f >= 0.0 for f in found[:1])
        self.require(in_order, "frequencies_hz: expected frequencies from the lowest one on")
        self.require(len(answer.shapes) == len(found), f"shapes: expected {len(found)}, got {len(answer.shapes)}")
        for shape in answer.shapes:
            for what, values in (("x", shape.x), ("y", shape.y), ("rz", shape.rz)):
                self.numbers(what, values, len(answer.nodes))
        if answer.losses:
            self.require(len(answer.losses) == len(found), f"losses: expected {len(found)}, got {len(answer.losses)}")
        parts = [
            part
            for loss in answer.losses
            for part in (loss.drag, loss.gas, loss.thermoelastic, loss.electrical, loss.anchors)
        ]
        self.numbers("losses", parts, len(parts))

    def response(self, answer: Any, signals: Sequence[str]) -> None:
        """Checks a frequency response: a value of each signal at each frequency."""
        count = len(answer.frequencies_hz)
        self.numbers("frequencies_hz", answer.frequencies_hz, count)
        self.names("signals", (signal.name for signal in answer.signals), signals)
        for signal in answer.signals:
            self.require(len(signal.re) == len(signal.im) == count, f"{signal.name}: expected {count} values")

    def pull_in(self, answer: Any) -> None:
        """Checks voltages of pull-in, release and snaps."""
        self.names("port", [answer.port])
        found = [answer.pull_in_v, answer.release_v, answer.release_before_snaps_v, *answer.snaps_v]
        self.numbers("voltages", found, len(found))

    def path(self, answer: Any, signals: Sequence[str]) -> None:
        """Checks a path: a value of each signal at each point, and critical points among its points."""
        count = len(answer.values)
        self.numbers("values", answer.values, count)
        self.require(len(answer.negative) == count, f"negative: expected {count} numbers, got {len(answer.negative)}")
        self.names("signals", (signal.name for signal in answer.signals), signals)
        for signal in answer.signals:
            self.numbers(signal.name, signal.values, count)
        for what, points in (("limit_points", answer.limit_points), ("bifurcations", answer.bifurcations)):
            self.numbers(what, [one.value for one in points], len(points))
            self.require(all(one.point < count for one in points), f"{what}: expected some of the {count} points")
        self.names("nodes", (node.name for node in answer.last))
        for node in answer.last:
            self.numbers(node.name, (node.x, node.y, node.rz), 3)

    def export(self, answer: Any) -> None:
        """Checks a file: names of its pins, and numbers of each mode."""
        self.names("pins", [answer.name, *answer.pins])
        content = answer.WhichOneof("content")
        self.require(content is not None, "content: expected a linear or a nonlinear model, got none")
        linear = answer.linear
        count = len(linear.frequencies_hz)
        self.numbers("frequencies_hz", linear.frequencies_hz, count)
        self.require(len(linear.quality) == len(linear.numbers) == count, f"quality: expected {count} numbers, got {len(linear.quality)}")
        self.numbers("band", (linear.from_hz, linear.to_hz, linear.error), 3)

    def samples(self, samples: Any, last: float, signals: int) -> None:
        """Checks samples after the time ``last`` [s]: a value of each signal at each time."""
        times = samples.t
        self.numbers("t", times, len(times))
        self.require(all(a <= b for a, b in zip([last, *times], times)), "t: expected times in their order")
        self.require(len(samples.signals) == signals, f"signals: expected {signals}, got {len(samples.signals)}")
        for column in samples.signals:
            self.numbers("signal", column.values, len(times))
