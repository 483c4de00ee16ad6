"""The live bench as a widget: its requests go through the kernel, and its numbers are those of the model."""

from __future__ import annotations

import json
import queue
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import bimorph

LIBRARY = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\n"
BEAM = """uses ../layers.net
param w = 2u            % width [m]
param F = 1u            % force on the tip [N]
anchor p [root] [l=10u w=10u]
beam2d p [root tip] [l=100u w=w]
f2d * [tip] [F=F oz=pi/2]
"""


class Page:
    """The other end of a widget."""

    def __init__(self, widget: Any) -> None:
        self.widget = widget
        self.replies: queue.Queue[tuple[dict[str, Any], bytes]] = queue.Queue()
        widget.send = lambda content, buffers: self.replies.put((content, bytes(buffers[0])))
        self.sent = 0

    def ask(self, ask: dict[str, Any], **state: Any) -> tuple[int, dict[str, Any]]:
        """Status and head of the answer."""
        self.sent += 1
        body = json.dumps({"channel": "static", "state": state, "ask": ask})
        self.widget._handle_custom_msg({"id": self.sent, "body": body}, [])
        content, reply = self.replies.get(timeout=30)
        assert content["id"] == self.sent
        if content["status"] != 200:
            return content["status"], json.loads(reply)
        length = int.from_bytes(reply[:4], "little")
        return 200, json.loads(reply[4 : 4 + length])


@pytest.fixture
def beam(client: bimorph.Client, tmp_path: Path, program: str, monkeypatch: pytest.MonkeyPatch) -> bimorph.Model:
    """A cantilever whose layer is in a file above it."""
    monkeypatch.setenv("BIMORPH_BIN", program)
    (tmp_path / "parts").mkdir()
    (tmp_path / "layers.net").write_text(LIBRARY)
    (tmp_path / "parts/beam.net").write_text(BEAM)
    return client.compile(tmp_path / "parts/beam.net", set={"w": 1.9e-6}, shear=True)


@pytest.fixture
def page(beam: bimorph.Model) -> Iterator[Page]:
    """The widget of the cantilever."""
    widget = beam.view()
    yield Page(widget)
    widget.close()


def test_a_widget_has_the_numbers_of_the_model(beam: bimorph.Model, page: Page, client: bimorph.Client) -> None:
    """The netlist with its include, its settings and options reach the bench: the same bits as from the server."""
    status, answer = page.ask({"kind": "static"})
    assert status == 200
    nodes = {name: tuple(values) for name, values in answer["nodes"]}
    expected = beam.static().nodes["tip"]
    assert nodes["tip"] == (expected.x, expected.y, expected.rz)
    status, answer = page.ask({"kind": "static"}, set={"F": 2e-6})
    assert dict((name, values[1]) for name, values in answer["nodes"])["tip"] == pytest.approx(2 * expected.y, rel=1e-3)
    status, answer = page.ask({"kind": "modes", "count": 2, "shapes": False})
    assert answer["frequencies_hz"] == list(beam.modes(count=2).frequencies_hz)


def test_a_widget_has_the_scripts_of_the_page(page: Page) -> None:
    """Script and style are those that the bench serves, and the widget begins with the state of the model."""
    status, script = page.widget._bench.request("GET", "bench.js")
    assert status == 200 and page.widget._esm == script.decode() and "export default" in script.decode()
    assert "height: 720px" in page.widget._css
    status, answer = page.ask({"kind": "describe"})
    assert {p["name"]: p["value"] for p in answer["parameters"]} == {"w": 1.9e-6, "F": 1e-6}
    assert [p["unit"] for p in answer["parameters"]] == ["m", "N"]


def test_refusals_reach_the_page(page: Page) -> None:
    """A refused request has its reason, and the bench still answers."""
    status, refusal = page.ask({"kind": "static"}, set={"nothing": 1})
    assert status == 422 and "nothing" in refusal["error"]
    assert page.ask({"kind": "static"})[0] == 200


def test_closing_ends_the_process(beam: bimorph.Model) -> None:
    """`close` ends the process and removes its files."""
    widget = beam.view({}, height=400)
    process, folder = widget._bench.process, Path(widget._bench._folder)
    assert process.poll() is None and folder.is_dir()
    widget.close()
    assert process.poll() is not None and not folder.exists()
