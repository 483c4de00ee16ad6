"""Every argument of every public function is checked by its name, before anything is sent: a table of bad values over all of them, by signature."""

from __future__ import annotations

import contextlib
import inspect
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bad_values import (
    VALUES,
    Accepts,
    either,
    empty_list,
    empty_mapping,
    flag,
    fresh,
    function,
    integer,
    never,
    nothing,
    number,
    seconds,
    text,
    text_or_empty,
)
from conftest import PLATE

import bimorph
from bimorph import layout
from bimorph import ngspice as spice

pytestmark = pytest.mark.filterwarnings("ignore")

NET = bimorph.Netlist.text(PLATE, "plate.net")
LAYOUT = "DS 1 1 1;\n9 BEAM;\nL ANCHOR1; B 2000 2000 1000 1000;\nL POLY1; B 4000 4000 1000 1000; B 10000 200 8000 1000;\nDF;\nC 1;\nE\n"
LONGEST = 5.0
"""No call of the table takes as long [s]."""

VOLTAGES = either(nothing, empty_mapping)
OPTIONAL_TEXT = either(nothing, text)
OPTIONAL_FUNCTION = either(nothing, function)


def path(value: Any) -> bool:
    """Texts and paths, which need not exist."""
    return text(value) or isinstance(value, Path)


class Serial:
    """An executor that computes at once."""

    def submit(self, task: Callable[..., Any], /, *arguments: Any) -> Any:
        """The result."""
        return bimorph_result(task(*arguments))


class bimorph_result:
    """A future that is there."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def result(self) -> Any:
        """It."""
        return self.value


@dataclass
class Case:
    """A public function, arguments that it accepts, and the values of the table that each parameter accepts too."""

    call: Callable[..., Any]
    good: dict[str, Any]
    accepts: dict[str, Accepts]
    signature: Callable[..., Any] | None = None
    """Whose parameters it has; None: its own."""
    skip: tuple[str, ...] = field(default=())


OPTIONS: dict[str, Accepts] = {
    "tol": either(nothing, number(1e-300, 0.999)),
    "band": either(nothing, number(0.0, 1e12, open_low=True)),
    "junctions": nothing,
    "anchors": nothing,
    "fringe": nothing,
    "linear": either(nothing, flag),
    "undamped": either(nothing, flag),
    "scheme": nothing,
    "segments": either(nothing, integer(1, 100_000)),
    "shear": either(nothing, flag),
    "rotary_inertia": either(nothing, flag),
    "imperfection": either(nothing, number(-0.1, 0.1)),
    "other_branch": either(nothing, flag),
    "as_sugar": either(nothing, flag),
    "without_circuit": either(nothing, flag),
    "formulation": nothing,
    "ranges": nothing,
}


@pytest.fixture(scope="module")
def cases(program: str, server: bimorph.Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Case]]:
    """All of them."""
    folder = tmp_path_factory.mktemp("arguments")
    cif = folder / "beam.cif"
    cif.write_text(LAYOUT)
    with contextlib.ExitStack() as stack:
        stack.enter_context(pytest.MonkeyPatch.context()).setenv("BIMORPH_BIN", program)
        client = stack.enter_context(server.client(timeout=30.0))
        model = client.compile(NET)
        session = stack.enter_context(model.session(["m.x", "m.y", "m.rz"]))
        reply = session.operating_point({"drive": 1.0})
        kept = stack.enter_context(model.session(kept=True))
        table = client.sweep(NET, {"k": [1.0, 2.0]}, bimorph.Modes(1))
        running = stack.enter_context(client.submit(NET, {"k": [1.0, 2.0]}, bimorph.Modes(1)))
        values = {"k": [1.0]}
        yield {
            **servers(server),
            **clients(client, cif, running, kept, values),
            **models(model, session),
            **sessions(session, reply),
            **batches(stack.enter_context(bimorph.Batch.of([model] * 3, ["m.x"])), model),
            **of_sweeps(running, table, server.address, values),
            **values_of_sweeps(),
            **layouts(folder),
        }


def servers(server: bimorph.Server) -> dict[str, Case]:
    """What starts and finds servers."""
    files = dict.fromkeys(("ca", "token_file", "client_cert", "client_key"), either(nothing, path))
    token = either(nothing, text)
    return {
        "Server": Case(bimorph.Server, {}, {"binary": either(nothing, path)}),
        "Server.client": Case(server.client, {}, {"timeout": seconds}),
        "serve": Case(bimorph.serve, {"binary": "/nosuch"}, {"binary": nothing}),
        "Client": Case(bimorph.Client, {"address": "unix:///nosuch"}, {"address": text, "timeout": seconds, "token": token, **files}),
    }


def clients(client: bimorph.Client, cif: Path, running: bimorph.Sweep, kept: bimorph.Session, values: Any) -> dict[str, Case]:
    """Methods of a client."""
    good = {"netlist": NET, "parameters": values, "analysis": bimorph.Modes(1)}
    sets = either(nothing, empty_mapping)
    shared: dict[str, Accepts] = {
        "netlist": never,
        "set": sets,
        "include": either(empty_list, one_name, texts),
        "parameters": empty_mapping,
        "analysis": never,
        "samples": nothing,
        "shard": never,
        "progress": OPTIONAL_FUNCTION,
        "share": flag,
        "release_after": either(nothing, number(0.0, 1e9, open_low=True)),
        **OPTIONS,
    }
    file = str(cif.with_suffix(".net"))
    Path(file).write_text(PLATE)
    return {
        "Client.convert": Case(client.convert, {"layout": cif}, {"layout": never, "process": nothing, "cell": nothing}),
        "Client.compile": Case(client.compile, {"netlist": file}, shared),
        "Client.sweep": Case(client.sweep, good | {"netlist": file}, shared),
        "Client.submit": Case(lambda **given: client.submit(**given).delete(), good | {"netlist": file}, shared, client.submit),
        "Client.attach": Case(client.attach, {"sweep": running.id}, {"sweep": never}),
        "Client.resume": Case(lambda **given: client.resume(**given).leave(), {"ticket": kept.ticket()}, {"ticket": never, "timeout": seconds}, client.resume),
    }


def one_name(value: Any) -> bool:
    """A list of names, which the server may not know."""
    return isinstance(value, list) and len(value) == 1 and isinstance(value[0], str)


def texts(value: Any) -> bool:
    """An array of names is a list of names."""
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind == "U"


def models(model: bimorph.Model, session: bimorph.Session) -> dict[str, Case]:
    """Methods of a model."""
    ac = {"drive": "m.fx", "start": 1e3, "stop": 2e3, "points": 3}
    return {
        "Model.view": Case(lambda **given: model.view(**given).close(), {}, {"voltages": VOLTAGES, "height": integer(200, 4000)}, model.view),
        "Model.static": Case(model.static, {}, {"voltages": VOLTAGES, "backbend": VOLTAGES}),
        "Model.modes": Case(model.modes, {"count": 1}, {"count": integer(1, 1000), "voltages": VOLTAGES, "quality": flag}),
        "Model.ac": Case(
            model.ac,
            ac,
            {
                "drive": never,
                "signals": empty_list,
                "start": number(0.0, 2e3, open_low=True),
                "stop": number(1e3, 1e12),
                "points": integer(1, 1000),
                "spacing": never,
                "even": flag,
                "by_modes": flag,
                "modes": integer(0, 1000),
                "voltages": VOLTAGES,
            },
        ),
        "Model.pull_in": Case(model.pull_in, {}, {"max_v": never, "port": lambda value: isinstance(value, str) and value == ""}),
        "Model.path": Case(
            model.path,
            {"along": "drive", "start": -1.0, "stop": 0.5, "points": 4},
            {
                "along": never,
                "start": number(-10.0, 10.0),
                "stop": lambda value: number(-10.0, 10.0)(value) and value != -1.0,
                "signals": empty_list,
                "branch": never,
                "points": integer(2, 1000),
                "voltages": VOLTAGES,
            },
        ),
        "Model.export": Case(
            model.export,
            {"voltages": {"drive": 2.0}},
            {
                "language": never,
                "ports": either(empty_list, empty_mapping),
                "signals": either(empty_list, empty_mapping),
                "voltages": VOLTAGES,
                "to": either(nothing, number(0.0, 1e12, open_low=True)),
                "within": either(nothing, number(1e-9, 0.999)),
                "count": either(nothing, integer(1, 1000)),
                "name": either(nothing, lambda value: text(value) and value.isidentifier()),
                "nonlinear": lambda value: value is False,
                "ranges": either(nothing, empty_mapping),
            },
        ),
        "Model.transient": Case(
            model.transient,
            {"stop": 1e-6, "signals": ["m.x"], "points": 3},
            {
                "stop": number(0.0, 1.0, open_low=True),
                "signals": never,
                "points": integer(2, 1000),
                "tol": number(0.0, 0.0),
                "voltages": VOLTAGES,
                "inputs": VOLTAGES,
                "estimate": flag,
                "release": nothing,
                "until": nothing,
                "events": empty_list,
                "method": nothing,
                "rho": nothing,
                "step": either(nothing, number(1e-9, 1.0)),
                "progress": OPTIONAL_FUNCTION,
            },
        ),
        "Model.session": Case(
            lambda **given: model.session(**given).close(),
            {},
            {
                "signals": empty_list,
                "ports": empty_list,
                "timeout": seconds,
                "seed": either(nothing, integer(0)),
                "noise_band": nothing,
                "kept": flag,
            },
            model.session,
        ),
        "Model.restore": Case(
            lambda **given: model.restore(**given).close(), {"snapshot": session.snapshot()}, {"snapshot": never, "timeout": seconds}, model.restore
        ),
    }


def sessions(session: bimorph.Session, reply: bimorph.TrialReply) -> dict[str, Case]:
    """Methods of a session."""
    volts = {"drive": 1.0}
    omega = number(0.0, 1e12)
    return {
        "Session.trial": Case(session.trial, {"voltages": volts}, {"voltages": empty_mapping, "dt": either(nothing, number(0.0, 1e9, open_low=True)), "parent": nothing}),
        "Session.accept": Case(session.accept, {"reply": reply}, {"reply": never, "voltages": VOLTAGES}),
        "Session.operating_point": Case(session.operating_point, {"voltages": volts}, {"voltages": empty_mapping}),
        "Session.step": Case(session.step, {"voltages": volts, "dt": 1e-9}, {"voltages": empty_mapping, "dt": number(0.0, 1.0, open_low=True)}),
        "Session.linearize": Case(session.linearize, {"omega": 1e3}, {"omega": omega, "reply": nothing}),
        "Session.noise": Case(session.noise, {"omega": 1e3}, {"omega": omega, "reply": nothing}),
        "Session.read": Case(session.read, {"signal": "m.x"}, {"signal": never}),
        "Session.motion": Case(session.motion, {"node": "m"}, {"node": never}),
    }


def batches(batch: bimorph.Batch, model: bimorph.Model) -> dict[str, Case]:
    """Sessions as a batch: arrays have a number for each session, or for each of three times."""
    times = np.array([1e-9, 2e-9, 3e-9])

    def run(**given: Any) -> None:
        later = batch.t.max()
        batch.run(**{"times": later + times, "voltages": {}, **given})
        batch.operating_point({})

    def three(value: Any) -> bool:
        return isinstance(value, dict) and (not value or repr(value) == "{'drive': [1.0, 2.0, 3.0]}")

    opened = lambda **given: bimorph.Batch.of(**given).close()  # noqa: E731
    names = {"signals": empty_list, "ports": empty_list, "timeout": seconds}
    return {
        "Batch": Case(bimorph.Batch, {"sessions": batch.sessions}, {"sessions": never}),
        "Batch.of": Case(opened, {"models": [model]}, {"models": never, **names}, bimorph.Batch.of),
        "Batch.operating_point": Case(batch.operating_point, {"voltages": {}}, {"voltages": three}),
        "Batch.run": Case(run, {}, {"times": ascending, "voltages": three, "signals": either(nothing, empty_list)}, batch.run),
        "Batch.step": Case(batch.step, {"voltages": {}, "dt": 1e-9}, {"voltages": three, "dt": number(0.0, 1e3, open_low=True)}),
    }


def ascending(value: Any) -> bool:
    """Times that ascend from above 0."""
    if isinstance(value, tuple):
        return value == (1, 2, 3)
    return isinstance(value, np.ndarray) and value.shape == (2,) and value.dtype.kind == "f" and not np.ma.is_masked(value)


def of_sweeps(running: bimorph.Sweep, table: bimorph.Table, address: str, values: Any) -> dict[str, Case]:
    """Handles, tables, and sweeps on executors."""
    good = {"executor": Serial(), "netlist": NET, "parameters": values, "analysis": bimorph.Modes(1), "shards": 1, "server": address}
    sets = either(nothing, empty_mapping)
    accepts: dict[str, Accepts] = {
        "executor": never,
        "netlist": never,
        "parameters": empty_mapping,
        "analysis": never,
        "shards": never,
        "server": nothing,
        "set": sets,
        "include": lambda value: True,  # a netlist is given, which has its files
        "samples": nothing,
        "retries": integer(0),
        "progress": OPTIONAL_FUNCTION,
        **OPTIONS,
    }
    return {
        "Sweep.wait": Case(running.wait, {}, {"progress": OPTIONAL_FUNCTION}),
        "Sweep.rows": Case(lambda **given: list(running.rows(**given)), {}, {"first": integer(0)}, running.rows),
        "Table.column": Case(table.column, {"name": "f1"}, {"name": never}),
        "Table.statistics": Case(table.statistics, {}, {"limits": empty_list, "percentiles": either(empty_list, arrays)}),
        "Table.histogram": Case(table.histogram, {"name": "f1"}, {"name": never, "bins": integer(1, 1000)}),
        "Limit": Case(bimorph.Limit, {"name": "f1", "relation": "<", "value": 1.0}, {"name": text, "relation": never, "value": number()}),
        **pictures(table),
        **files(table),
        "sweep_on": Case(bimorph.sweep_on, good, accepts),
    }


def arrays(value: Any) -> bool:
    """Percentages."""
    if isinstance(value, tuple):
        return value == (1, 2, 3)
    is_array = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind == "f" and not np.ma.is_masked(value)
    return hasattr(value, "__next__") or is_array


def drawn(table: bimorph.Table) -> Callable[..., None]:
    """Draws a table on axes that are given."""

    def draw(ax: Any) -> None:
        if ax is not None:
            table.plot(ax=ax)

    return draw


def pictures(table: bimorph.Table) -> dict[str, Case]:
    """Tables drawn, where matplotlib is installed."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        return {}

    def draw(name: Any) -> None:
        table.plot(name)
        pyplot.close("all")

    return {
        "Table.plot": Case(draw, {"name": "f1"}, {"name": nothing}, table.plot, skip=("ax",)),
        "Table.plot on": Case(drawn(table), {"ax": None}, {"ax": nothing}),
    }


def files(table: bimorph.Table) -> dict[str, Case]:
    """Tables written to a store that nothing else sees, where Arrow is installed."""
    try:
        from pyarrow import fs
    except ImportError:
        return {}
    store = fs._MockFileSystem()

    def in_memory(path: Any) -> None:
        table.to_parquet(path, filesystem=store)

    def over(filesystem: Any) -> None:
        if filesystem is not None:
            table.to_parquet("/nosuch/a/b", filesystem=filesystem)

    return {
        "Table.to_parquet": Case(in_memory, {"path": "a"}, {"path": text}, table.to_parquet, skip=("filesystem",)),
        "Table.to_parquet over": Case(over, {"filesystem": None}, {"filesystem": nothing}),
    }


def values_of_sweeps() -> dict[str, Case]:
    """Analyses of sweeps, distributions, samples, netlists."""
    vary = {"k": bimorph.Normal(1.0, 0.1)}
    above = number(0.0, open_low=True)
    return {
        "Static": Case(bimorph.Static, {}, {"outputs": either(empty_list, texts, one_name), "voltages": VOLTAGES}),
        "Modes": Case(bimorph.Modes, {}, {"count": integer(1), "voltages": VOLTAGES}),
        "PullIn": Case(bimorph.PullIn, {}, {"max_v": above, "port": text_or_empty}),
        "Transient": Case(
            bimorph.Transient,
            {"stop": 1e-6, "signals": ["m.x"]},
            {"stop": above, "signals": either(texts, one_name), "voltages": VOLTAGES},
        ),
        "Normal": Case(bimorph.Normal, {"mean": 1.0, "deviation": 0.1}, {"mean": number(), "deviation": number(0.0)}),
        "LogNormal": Case(bimorph.LogNormal, {"median": 1.0, "deviation": 0.1}, {"median": above, "deviation": number(0.0)}),
        "Uniform": Case(bimorph.Uniform, {"low": -1e301, "high": 1e301}, {"low": number(), "high": number()}),
        "Samples": Case(
            bimorph.Samples,
            {"vary": vary, "count": 3},
            {"vary": never, "count": integer(1), "seed": integer(0, 2**64 - 1), "design": never, "correlations": empty_mapping},
        ),
        "Netlist": Case(bimorph.Netlist, {"root": "a", "files": {"a": ""}}, {"root": never, "files": never}),
        "Netlist.text": Case(bimorph.Netlist.text, {"text": PLATE}, {"text": lambda value: isinstance(value, str), "name": text}),
    }


def layouts(folder: Path) -> dict[str, Case]:
    """Cells, mechanisms, decks and raw files."""
    made = layout.Mechanism()
    numbered = iter(range(10**6))
    file = folder / "plate.net"
    file.write_text(PLATE)

    def add(**given: Any) -> None:
        made.add(**({"name": f"pad{next(numbered)}"} | given))

    cell = layout.anchor()
    deck = "* nothing\nR1 a 0 1\nV1 a 0 1\n.op\n.end\n"
    return {
        "Netlist.read": Case(bimorph.Netlist.read, {"path": file}, {"path": never, "include": either(empty_list, texts, one_name)}),
        "layout.anchor": Case(layout.anchor, {}, {"length": number(), "width": number()}, lambda length, width: None),
        "Mechanism": Case(layout.Mechanism, {}, {"process": text}),
        "Mechanism.add": Case(
            add, {"cell": cell, "a": "b"}, {"cell": never, "angle": number(), "mirrored": flag, "a": text_of_name}, lambda cell, angle, mirrored, a: None
        ),
        "Mechanism.add named": Case(
            lambda **given: layout.Mechanism().add(cell=cell, a="b", **given), {"name": "p"}, {"name": text_of_name}, lambda name: None
        ),
        "Mechanism.place": Case(
            made.place, {"origin": "a", "node": "b", "x": 0.0, "y": 0.0}, {"origin": text_of_name, "node": text_of_name, "x": number(), "y": number()}
        ),
        "Mechanism.line": Case(made.line, {"text": ""}, {"text": text_or_empty}),
        "Mechanism.netlist": Case(made.netlist, {}, {"name": text}),
        "from_gdsfactory": Case(
            layout.from_gdsfactory,
            {"component": {"instances": {}}},
            {"component": never, "kinds": either(nothing, empty_mapping), "process": text},
        ),
        "ngspice.run": Case(spice.run, {"deck": deck}, {}, skip=("remote", "timeout")),
        "ngspice.read_raw": Case(spice.read_raw, {"content": b""}, {"content": never}),
    }


def text_of_name(value: Any) -> bool:
    """Letters, digits and _, a letter first."""
    return text(value) and value.isidentifier()


def parameters(case: Case) -> list[str]:
    """The names of its parameters, options of a model among them."""
    found: list[str] = []
    for name, parameter in inspect.signature(case.signature or case.call).parameters.items():
        found += list(OPTIONS) if parameter.kind is parameter.VAR_KEYWORD else [name]
    return [name for name in found if name not in case.skip]


def outcome(case: Case, name: str, value: Any) -> str:
    """How a call with this value ends: "accepted", "rejected" by name, or what is wrong."""
    start = time.monotonic()
    try:
        made = case.call(**(case.good | {name: value}))
        if isinstance(made, bimorph.Server):
            made.close()
        found = "accepted"
    except (TypeError, ValueError, KeyError, OSError, bimorph.BimorphError) as error:
        words = str(error)
        found = "rejected" if name in words else f"{type(error).__name__} without its name: {words[:200]}"
        if isinstance(error, KeyError) and not isinstance(error, ValueError):
            found = f"KeyError: {words}"
    except Exception as error:  # noqa: BLE001
        found = f"{type(error).__name__}: {error}"
    took = time.monotonic() - start
    return found if took < LONGEST else f"{found} after {took:.1f} s"


def test_bad_arguments_are_rejected_by_name(cases: dict[str, Case]) -> None:
    """Of each parameter each value of the table is accepted, where the list of the parameter has it, or rejected with the name of the parameter."""
    wrong, count = [], 0
    for called, case in cases.items():
        if called not in ("serve", "ngspice.run"):
            case.call(**case.good)
        for name in parameters(case):
            accepts = case.accepts.get(name, never)
            for title in VALUES:
                count += 1
                value = fresh(title)
                expected = "accepted" if accepts(value) else "rejected"
                found = outcome(case, name, fresh(title))
                if found != expected:
                    wrong.append(f"{called}({name}={title}): expected {expected}, got {found}")
    assert not wrong, f"{len(wrong)} of {count}:\n" + "\n".join(wrong[:400])
    assert count >= 3490


MADE_BY_CALLS = {
    *("AnchorForce", "Conversion", "Diagnostic", "FrequencyResponse", "ModeLoss", "Model", "ModesResult", "NodeMotion", "Options", "Piece", "PullInResult", "Root"),
    *("Row", "Session", "Snapshot", "StaticResult", "Statistics", "Sweep", "SweepStatus", "Table", "Ticket", "TransientResult", "TrialReply"),
    *("BatchRun", "ColumnStatistics", "CriticalPoint", "Crossing", "ExportResult", "PathResult", "StabilityLoss", "Failure", "Fraction", "Histogram", "Run", "SweepStatistics"),
    *("Violation", "aio", "local"),
}
"""Public names without arguments of a user: what calls give, the package for asyncio, which passes its arguments on, and `local()`."""

IN_TEST_RUNS = {"Session.run"}
"""Methods whose arguments test_runs.py checks."""


def test_every_public_function_is_in_the_table(cases: dict[str, Case]) -> None:
    """Every public name, and every public method that takes arguments, of the classes whose methods users call."""
    for name in set(bimorph.__all__) - MADE_BY_CALLS:
        thing = getattr(bimorph, name)
        if isinstance(thing, type) and issubclass(thing, (Exception, Warning)):
            continue
        assert name in cases, name
    for kind in (bimorph.Client, bimorph.Model, bimorph.Session, bimorph.Batch, bimorph.Sweep, bimorph.Server, bimorph.Netlist, layout.Mechanism):
        for name, method in inspect.getmembers(kind, callable):
            if not name.startswith("_") and set(inspect.signature(method).parameters) - {"self"}:
                assert f"{kind.__name__}.{name}" in cases.keys() | IN_TEST_RUNS, (kind, name)


def test_options_are_those_of_the_table() -> None:
    """Each option of a model has its values."""
    assert set(OPTIONS) == set(bimorph.Options.__annotations__)
