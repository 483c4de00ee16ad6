"""A server that lies: each lie is one error that names the server and what is wrong, within the time of the call."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent import futures
from pathlib import Path
from typing import Any

import grpc
import pytest

import bimorph
from bimorph.v1 import analysis_pb2, device_pb2, model_pb2, service_pb2_grpc

CONTROLS = "\x1b]0;x\x07\x1b[2J"
TIMEOUT = 2.0
"""Longest time of a call of a session [s]."""


class Liar(service_pb2_grpc.BimorphServicer):
    """Answers as a device of two ports, but for one lie."""

    lie = ""

    def Info(self, request: Any, context: Any) -> Any:  # noqa: N802
        return model_pb2.InfoResponse(version=bimorph.__version__, protocols=["bimorph.v1"])

    def Compile(self, request: Any, context: Any) -> Any:  # noqa: N802
        if self.lie == "compile controls":
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, CONTROLS + "line\nother")
        ports = [CONTROLS, "b"] if self.lie == "compile ports" else ["a", "b"]
        return model_pb2.CompileResponse(model=model_pb2.ModelDescription(id="0" * 32, ports=ports, nodes=["n"], unknowns=3))

    def Check(self, request: Any, context: Any) -> Any:  # noqa: N802
        return model_pb2.CheckResponse(ok=True)

    def Describe(self, request: Any, context: Any) -> Any:  # noqa: N802
        return model_pb2.DescribeResponse(model=self.Compile(request, context).model)

    def Static(self, request: Any, context: Any) -> Any:  # noqa: N802
        x = math.nan if self.lie == "static" else 0.0
        return analysis_pb2.StaticResponse(nodes=[analysis_pb2.NodeMotion(name="n", x=x)])

    def Modes(self, request: Any, context: Any) -> Any:  # noqa: N802
        found = {"modes order": [2.0, 1.0], "modes nan": [math.nan, 1.0]}.get(self.lie, [1.0, 2.0])
        shape = analysis_pb2.Shape(x=[0.0] * (7 if self.lie == "modes shape" else 1), y=[0.0], rz=[0.0])
        return analysis_pb2.ModesResponse(frequencies_hz=found, nodes=["n"], shapes=[shape] * 2, errors=[0.0] * 2)

    def Trial(self, requests: Any, context: Any) -> Iterator[Any]:  # noqa: N802
        # a server of ours sends its headers at once
        context.send_initial_metadata(())
        for request in requests:
            if request.HasField("open"):
                signals = [device_pb2.Signal(name=name, unit="m") for name in request.open.signals]
                if self.lie == "open kind":
                    yield device_pb2.DeviceReply(trial=device_pb2.TrialReply(status=1, token=1))
                    continue
                device = device_pb2.DeviceDescription(
                    ports=["a", "b"] * (9 if self.lie == "open ports" else 1), signals=signals, port_kinds=[0, 0], unknowns=3
                )
                yield device_pb2.DeviceReply(opened=device_pb2.OpenResponse(session="s", device=device))
            elif request.HasField("trial"):
                if self.lie == "never":
                    time.sleep(TIMEOUT + 3.0)
                trial = self.trial(request.trial)
                yield trial
                if self.lie == "extra":
                    yield trial
            elif request.HasField("linearize"):
                yield device_pb2.DeviceReply(linearized=device_pb2.SmallSignal(admittance_re=[math.nan]))

    def trial(self, request: Any) -> Any:
        token = int(1000 * request.voltages[0]) + 7
        reply = device_pb2.TrialReply(
            status=1, token=token, currents=[0.0] * 2, charges=[0.0] * 2, di_dv=[0.0] * 4, dq_dv=[0.0] * 4,
            outputs=[0.0], doutputs_dv=[0.0] * 2, dt_next=math.inf,
        )
        need = device_pb2.TrialReply.STATUS_NEED_DT
        lies: dict[str, Callable[[], Any]] = {
            "nan": lambda: reply.currents.__setitem__(1, math.nan),
            "many": lambda: reply.currents.extend([0.0] * 5),
            "none": lambda: reply.ClearField("di_dv"),
            "status": lambda: setattr(reply, "status", 99),
            "no token": lambda: setattr(reply, "token", 0),
            "old": lambda: setattr(reply, "token", 7),
            "next nan": lambda: setattr(reply, "dt_next", math.nan),
            "next tiny": lambda: setattr(reply, "dt_next", 1e-300),
            "need nan": lambda: reply.CopyFrom(device_pb2.TrialReply(status=need, need_dt=math.nan)),
            "need more": lambda: reply.CopyFrom(device_pb2.TrialReply(status=need, need_dt=1.0)),
            "fails": lambda: reply.CopyFrom(device_pb2.TrialReply(status=3, reason=CONTROLS)),
        }
        if request.dt > 0.0 or not self.lie.startswith(("next", "need")):
            lies.get(self.lie, lambda: None)()
        if self.lie == "kind":
            return device_pb2.DeviceReply(linearized=device_pb2.SmallSignal())
        return device_pb2.DeviceReply(trial=reply) if self.lie != "empty" else device_pb2.DeviceReply()


@pytest.fixture(scope="module")
def lying(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Liar, str]]:
    """A server that lies, and its address."""
    path: Path = tmp_path_factory.mktemp("lying") / "s"
    liar, server = Liar(), grpc.server(futures.ThreadPoolExecutor(16))
    service_pb2_grpc.add_BimorphServicer_to_server(liar, server)
    server.add_insecure_port(f"unix:{path}")
    server.start()
    yield liar, f"unix://{path}"
    server.stop(None)


def run(address: str) -> None:
    """Everything that a client asks."""
    with bimorph.Client(address) as client:
        model = client.compile(bimorph.Netlist.text("anything", "a.net"))
        model.static()
        model.modes(2)
        with model.session(["n.x"], timeout=TIMEOUT) as session:
            session.operating_point({"a": 1.0})
            for k in range(5):
                session.step({"a": 2.0 + k}, 1e-6)


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ("compile ports", "ports: expected a name"),
        ("static", r"n\[0\]: expected a finite number, got nan"),
        ("modes order", "frequencies_hz: expected frequencies from the lowest"),
        ("modes nan", "frequencies_hz"),
        ("modes shape", "x: expected 1 numbers, got 7"),
        ("open kind", "expected one of kind opened, got trial"),
        ("open ports", "port_kinds"),
        ("nan", r"currents\[1\]: expected a finite number, got nan"),
        ("many", "currents: expected 2 numbers, got 7"),
        ("none", "di_dv: expected 4 numbers, got 0"),
        ("status", "status: 99 is not known"),
        ("no token", "token: expected one, got 0"),
        ("old", "it names the state of an earlier trial"),
        ("next nan", "dt_next: expected a time above"),
        ("next tiny", "dt_next: expected a time above"),
        ("need nan", "need_dt: expected less than the step"),
        ("need more", "need_dt: expected less than the step"),
        ("kind", "expected one of kind trial, got linearized"),
        ("empty", "expected one of kind trial, got none"),
        ("extra", "no request is open|names the state of an earlier trial"),
    ],
)
def test_lies_are_named(lying: tuple[Liar, str], lie: str, message: str) -> None:
    """Each lie raises UnexpectedReply with the server and what was expected, long before anything hangs."""
    liar, address = lying
    liar.lie = lie
    start = time.monotonic()
    with pytest.raises(bimorph.UnexpectedReply, match=message) as caught:
        run(address)
    assert "server " in str(caught.value)
    assert "\x1b" not in str(caught.value)
    assert time.monotonic() - start < 20.0


def test_the_truth_is_taken(lying: tuple[Liar, str]) -> None:
    """Without a lie all of it runs."""
    liar, address = lying
    liar.lie = ""
    run(address)


def test_text_controls_no_terminal(lying: tuple[Liar, str]) -> None:
    """What a server writes is shown without what controls a terminal, line breaks as they are."""
    liar, address = lying
    for lie, kind in (("compile controls", bimorph.InvalidRequest), ("fails", bimorph.StepFailed)):
        liar.lie = lie
        with pytest.raises(kind) as caught:
            run(address)
        assert "\x1b" not in str(caught.value)
        assert "\\x1b[2J" in str(caught.value)


def test_no_call_outlives_its_time(lying: tuple[Liar, str]) -> None:
    """A server that does not answer is left after the time of the call."""
    liar, address = lying
    liar.lie = "never"
    start = time.monotonic()
    with pytest.raises(bimorph.Unavailable):
        run(address)
    assert time.monotonic() - start < TIMEOUT + 3.0
