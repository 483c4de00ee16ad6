"""A server that lies about the steps of a run: each lie is one error that names the server and what is wrong."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from concurrent import futures
from pathlib import Path
from typing import Any

import grpc
import numpy as np
import pytest
from test_lying import CONTROLS, Liar

import bimorph
from bimorph.v1 import device_pb2, run_pb2, service_pb2_grpc

STEPS = 4


def packed(values: list[float]) -> bytes:
    return np.array(values, dtype="<f8").tobytes()


class RunLiar(Liar):
    """Its runs of a device of two ports and one signal have two messages of two steps, but for one lie."""

    def Run(self, request: Any, context: Any) -> Iterator[Any]:  # noqa: N802
        if self.lie == "run never":
            time.sleep(4.0)
        for first in (0, 2):
            rows = run_pb2.RunRows(
                first=first, count=2, outputs=packed([0.0] * 2), currents=packed([0.0] * 4), charges=packed([0.0] * 4)
            )
            match self.lie:
                case "run nan":
                    rows.outputs = packed([0.0, math.nan])
                case "run short":
                    rows.currents = packed([0.0] * 3)
                case "run lane":
                    rows.lane = 3
                case "run order":
                    rows.first = 2
                case "run many":
                    rows.count, rows.outputs = 9, packed([0.0] * 9)
            yield run_pb2.RunEvent(rows=[rows], progress=0.5)
        if self.lie == "run no end":
            return
        last = self.trial(device_pb2.TrialRequest(voltages=[1.0, 0.0])).trial
        if self.lie == "run last":
            last.ClearField("charges")
        end = run_pb2.RunEnd(steps=2 if self.lie == "run steps" else STEPS, trials=4, last=last)
        if self.lie == "run no last":
            end.ClearField("last")
        if self.lie == "run error":
            end.error = "why"
        yield run_pb2.RunEvent(ends=[end])
        if self.lie == "run more":
            yield run_pb2.RunEvent(ends=[end])
        if self.lie == "run fails":
            context.abort(grpc.StatusCode.INTERNAL, CONTROLS)


@pytest.fixture(scope="module")
def lying(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunLiar, str]]:
    """A server that lies, and its address."""
    path: Path = tmp_path_factory.mktemp("lying") / "s"
    liar, server = RunLiar(), grpc.server(futures.ThreadPoolExecutor(16))
    service_pb2_grpc.add_BimorphServicer_to_server(liar, server)
    server.add_insecure_port(f"unix:{path}")
    server.start()
    yield liar, f"unix://{path}"
    server.stop(None)


def run(address: str) -> bimorph.Run:
    with bimorph.Client(address) as client:
        model = client.compile(bimorph.Netlist.text("anything", "a.net"))
        with model.session(["n.x"], timeout=1.0) as session:
            return session.run(1e-6 * np.arange(1, STEPS + 1), {"a": 1.0})


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ("run nan", r"outputs\[1\]: expected a finite number, got nan"),
        ("run short", "currents: expected 4 numbers, got 24 bytes"),
        ("run lane", "lane 3 does not run"),
        ("run order", "rows: expected those from 0 on"),
        ("run many", "rows: expected those from 0 on"),
        ("run no end", "the stream ended before the run did"),
        ("run last", "charges: expected 2 numbers, got 0"),
        ("run no last", "expected the reply to the last step"),
        ("run steps", "end: expected that of 4 of 4 steps, got one of 2"),
        ("run error", "end: expected that of 4 of 4 steps"),
        ("run more", "lane 0 does not run"),
    ],
)
def test_lies_about_runs_are_named(lying: tuple[RunLiar, str], lie: str, message: str) -> None:
    """Each raises UnexpectedReply with the server and what was expected."""
    liar, address = lying
    liar.lie = lie
    with pytest.raises(bimorph.UnexpectedReply, match=message) as caught:
        run(address)
    assert "server " in str(caught.value)


def test_the_truth_about_a_run_is_taken(lying: tuple[RunLiar, str]) -> None:
    """Without a lie it has its steps."""
    liar, address = lying
    liar.lie = ""
    assert len(run(address)) == STEPS


def test_a_run_of_which_nothing_is_heard_ends(lying: tuple[RunLiar, str]) -> None:
    """After the time of a call; what a failed one writes controls no terminal."""
    liar, address = lying
    liar.lie = "run never"
    start = time.monotonic()
    with pytest.raises(bimorph.Unavailable, match="no answer within 1.0 s"):
        run(address)
    assert time.monotonic() - start < 3.5
    liar.lie = "run fails"
    with pytest.raises(bimorph.BimorphError) as caught:
        run(address)
    assert "\x1b" not in str(caught.value)
