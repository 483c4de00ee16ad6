"""The page in a real browser: its numbers are those of the command, and each of its parts works."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from conftest import BIMORPH, ROOT, command, processor_time

EXAMPLES = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "examples").glob("*/*.net"))


def nodes_of(document: dict[str, Any]) -> dict[str, list[float]]:
    return {name: [m["x"], m["y"], m["rz"]] for name, m in document["nodes"].items()}


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_loads(bench: Any, example: str) -> None:
    """Each example has a picture, sliders for its ports and parameters, and the displacements that `bimorph static` prints, bit by bit."""
    page = bench(example).open()
    assert page.run("return page.failed && page.failed.message") is None
    assert {name: value for name, value in page.run("return page.static.nodes")} == nodes_of(command("static", example))
    described = page.run("return page.description")
    names = page.run("return [...document.querySelectorAll('.slider')].map(s => s.dataset.name)")
    assert set(names) == {p["name"] for p in described["ports"] + described["parameters"] if "text" not in p}
    painted = page.run(
        "const c = document.querySelector('.figure canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        "let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n"
    )
    assert painted > 200, "the mechanism is drawn"


def test_a_slider_moves_the_device(bench: Any) -> None:
    """Port and parameter sliders give what the command gives, the marker stands there, and the frequencies follow."""
    file = "examples/comb_resonator/comb_resonator.net"
    page = bench(file).open()
    page.slide("drive", 40.0)
    page.slide("w", 1.9e-6)
    expected = command("static", file, "--set", "w=1.9u", "--port", "drive=40")
    page.wait("return Math.abs(page.signal('shuttle.x') - arguments[0]) === 0", expected["nodes"]["shuttle"]["x"])
    frequencies = command("modes", file, "--set", "w=1.9u", "--port", "drive=40", "--count", "3")["frequencies_hz"]
    page.wait("return JSON.stringify(page.frequencies?.frequencies_hz) === JSON.stringify(arguments[0])", frequencies)
    # the range input itself, as a pointer moves it
    page.run("const r = document.querySelector('.slider[data-name=\"drive\"] input[type=range]'); r.value = 200; r.dispatchEvent(new Event('input'))")
    volts = page.run("return page.state.ports.drive")
    moved = command("static", file, "--set", "w=1.9u", "--port", f"drive={volts!r}")["nodes"]["shuttle"]["x"]
    page.wait("return page.signal('shuttle.x') === arguments[0]", moved)
    assert "#" in page.run("return location.href") or page.wait("return location.hash.length > 3")
    page.run("[...document.querySelectorAll('header .acts button')].find(b => b.textContent === 'Reset').click()")
    page.wait("return page.signal('shuttle.x') === 0")


def test_a_link_holds_the_state(bench: Any) -> None:
    """The fragment of the address gives parameters, ports and the tab."""
    page = bench("examples/switch/switch.net")
    state = json.dumps({"set": {"touch": 9e-8}, "ports": {"drive": 12.5}, "tab": "path"})
    page.open(f"#{state}")
    expected = command("static", "examples/switch/switch.net", "--set", "touch=90n", "--port", "drive=12.5")
    assert page.run("return page.signal('a(8).y')") == expected["nodes"]["a(8)"]["y"]
    assert page.run("return document.querySelector('[role=tab][aria-selected=true]').id") == "tab-path"


def test_pull_in_in_words(bench: Any) -> None:
    """The page states pull-in and release of `bimorph pullin` in words, and that a state beyond it is pulled in."""
    page = bench("examples/switch/switch.net").open()
    found = command("pullin", "examples/switch/switch.net")
    expected = f"drive pulls in at {found['pull_in_v']:.2f} V and releases at {found['release_v']:.2f} V."
    page.wait("return document.querySelector('.words').innerText.includes(arguments[0])", expected)
    page.slide("drive", 19.0)
    page.wait("return document.querySelector('.words').innerText.includes('Pulled in')")


def test_a_mode_moves(bench: Any) -> None:
    """The modes tab shows the frequencies and Q of the command, and its picture changes by itself until it is paused."""
    page = bench("examples/bank/bank.net").open()
    page.tab("modes")
    page.wait("return page.tabs[1].answer")
    expected = command("modes", "examples/bank/bank.net", "--count", "6", "--quality")
    assert page.run("return page.tabs[1].answer.frequencies_hz") == expected["frequencies_hz"]
    quality = 1 / sum(expected["losses"][0][part] for part in ("drag", "gas", "thermoelastic", "electrical", "anchors"))
    assert page.run("return page.tabs[1].answer.qualities[0]") == pytest.approx(quality, rel=1e-12)
    picture = "return document.querySelector('.figure canvas').toDataURL()"
    first = page.run(picture)
    page.wait("return document.querySelector('.figure canvas').toDataURL() !== arguments[0]", first)
    page.run("page.tabs[1].setPlaying(false)")
    time.sleep(0.2)
    still = page.run(picture)
    time.sleep(0.3)
    assert page.run(picture) == still


def test_a_path(bench: Any) -> None:
    """The path tab names the limit points of `bimorph path` with their voltages."""
    page = bench("examples/switch/switch.net").open()
    page.tab("path")
    page.run("const t = page.tabs[2]; t.to.value = '20'; t.from.value = '0'; t.to.dispatchEvent(new Event('change'))")
    page.wait("return page.tabs[2].answer && page.tabs[2].answer.values.at(-1) === 20")
    expected = command("path", "examples/switch/switch.net", "--along", "drive=0:20")
    answer = page.run("return page.tabs[2].answer")
    assert answer["values"] == expected["values"]
    assert [(point["name"], point["value"]) for point in answer["critical"]] == [
        (name, fold["value"]) for name, fold in zip(("pull-in", "release"), expected["folds"])
    ]
    assert "pull-in at 17.84 V" in page.run("return page.tabs[2].words.innerText")


def test_a_transient(bench: Any) -> None:
    """Constant voltages give the run of `bimorph tran`; a pulse moves the part and lets it rest again; the scrub bar moves the picture."""
    file = "examples/comb_resonator/comb_resonator.net"
    page = bench(file, "--port", "drive=30").open()
    page.tab("transient")
    set_up = "const t = page.tabs[3]; t.stop.value = '50u'; t.points.value = 101; t.signals.value = 'shuttle.x'; t.answer = null; t.stop.dispatchEvent(new Event('change'))"
    page.run(set_up)
    page.wait("return page.tabs[3].answer && page.tabs[3].answer.t.length === 101 && page.tabs[3].answer.signals[0][0] === 'shuttle.x'")
    run = command("tran", file, "--stop", "50u", "--points", "101", "--port", "drive=30", "--signals", "shuttle.x")
    obtained = page.run("return page.tabs[3].answer.signals[0][2]")
    # the frames of the picture are further signals of the run, which the mesh search may treat otherwise
    largest = max(map(abs, run["signals"]["shuttle.x"]))
    assert max(abs(a - b) for a, b in zip(obtained, run["signals"]["shuttle.x"])) < 2e-3 * largest
    page.run("page.tabs[3].setPlaying(false); page.tabs[3].seek(0)")
    rest = page.wait("return document.querySelector('.figure canvas').toDataURL()")
    page.run("const s = page.tabs[3].scrub; s.value = 700; s.dispatchEvent(new Event('input'))")
    page.wait("return document.querySelector('.figure canvas').toDataURL() !== arguments[0]", rest)
    # a run under way still shows its answer
    page.wait("const of = page.latest('transient'); return !of.running && !of.waiting")
    page.run("const w = page.tabs[3].waves[0]; page.tabs[3].answer = null; w.input.value = 'PULSE(0 40 10u 1u 1u 200u)'; w.input.dispatchEvent(new Event('change'))")
    page.wait("return page.tabs[3].answer && page.tabs[3].answer.t.length > 100")
    moved = page.run("const a = page.tabs[3].answer, s = a.signals[0][2]; return [a.t, s]")
    before = [abs(x) for t, x in zip(*moved) if t < 9.9e-6]
    after = [abs(x) for t, x in zip(*moved) if t > 20e-6]
    assert max(before) == 0 and max(after) > 0
    page.run("const w = page.tabs[3].waves[0]; w.input.value = 'PULSE(0 40'; w.input.dispatchEvent(new Event('change'))")
    assert "expected" in page.run("return page.tabs[3].waves[0].message.innerText")


def test_a_drawn_waveform(bench: Any) -> None:
    """Clicks into the drawing of a port make corners of a waveform, and a click on a corner takes it away; the run follows them."""
    page = bench("examples/comb_resonator/comb_resonator.net").open()
    page.tab("transient")
    page.wait("return page.tabs[3].answer")
    page.run("const t = page.tabs[3]; t.stop.value = '40u'; t.signals.value = 'shuttle.x'; t.stop.dispatchEvent(new Event('change')); t.waves[0].input.value = '10'; t.waves[0].read(true)")
    click = (
        "const wave = page.tabs[3].waves[0], box = wave.surface.canvas.getBoundingClientRect();"
        "wave.surface.draw(); wave.surface.canvas.dispatchEvent(new MouseEvent('click', {clientX: box.left + arguments[0] * box.width, clientY: box.top + arguments[1] * box.height, bubbles: true}));"
        "wave.surface.draw(); return [wave.input.value, wave.corners]"
    )
    text, corners = page.run(click, 0.5, 0.5)
    assert text.startswith("PWL(0 10 ") and len(corners) == 2
    text, corners = page.run(click, 0.75, 0.9)
    assert len(corners) == 3 and corners[1][0] == pytest.approx(20e-6, rel=0.05) and corners[0][0] < corners[1][0] < corners[2][0]
    page.wait("const a = page.tabs[3].answer; return a && a.signals[0][0] === 'shuttle.x' && Math.abs(a.t.at(-1) - 40e-6) < 1e-12 && Math.max(...a.signals[0][2].map(Math.abs)) > 0")
    x, y = page.run("const w = page.tabs[3].waves[0], b = w.surface.canvas.getBoundingClientRect(); return [w.xAxis.at(w.corners[1][0]) / b.width, w.yAxis.at(w.corners[1][1]) / b.height]")
    assert len(page.run(click, x, y)[1]) == 2


def test_a_response(bench: Any) -> None:
    """The response tab has the values and resonances of `bimorph ac`, and marks the peak."""
    page = bench("examples/bank/bank.net").open()
    page.wait("return page.frequencies")
    page.tab("response")
    page.run("const t = page.tabs[4]; t.drive.value = 'yoke.fy'; t.signals.value = 'yoke.y'; t.from.value = '10k'; t.to.value = '1M'; t.answer = null; t.to.dispatchEvent(new Event('change'))")
    page.wait("return page.tabs[4].answer && page.tabs[4].answer.drive === 'yoke.fy' && page.tabs[4].answer.frequencies_hz[0] === 1e4")
    expected = command("ac", "examples/bank/bank.net", "--drive", "yoke.fy", "--signals", "yoke.y", "--from", "10k", "--to", "1M", "--points", "200")
    answer = page.run("return page.tabs[4].answer")
    assert [value[0] for value in answer["signals"][0]["values"]] == expected["signals"]["yoke.y"]["re"]
    assert [pole["frequency_hz"] for pole in answer["poles"]] == [pole["frequency_hz"] for pole in expected["poles"]]
    assert "Resonances" in page.run("return page.tabs[4].words.innerText")


def test_yield(bench: Any) -> None:
    """Samples give the statistics of `bimorph sweep`, and the worst one can be put on the bench."""
    page = bench("examples/bank/bank.net", "--port", "heat=2.2").open()
    page.tab("yield")
    page.run(
        "const t = page.tabs[6]; t.rows.forEach(r => { r.input.value = r.name === 'wh' ? '2.5' : '0'; }); t.signal.value = 'yoke.y'; t.count.value = 64; t.seed.value = 7; t.high.value = '-0.9u';"
        "t.run.click()"
    )
    page.wait("return page.tabs[6].answer")
    words = ["sweep", "examples/bank/bank.net", "--vary", "wh=normal:2e-6:5e-8", "--samples", "64", "--seed", "7", "--port", "heat=2.2", "--signals", "yoke.y"]
    table = subprocess.run([BIMORPH, *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    column = table[0].split(",").index("yoke.y [m]")
    assert page.run("return page.tabs[6].answer.rows.map(r => r[1])") == [float(line.split(",")[column]) for line in table[1:]]
    assert "yield" in page.run("return page.tabs[6].words.innerText")
    page.run("page.tabs[6].worst.click()")
    worst = page.run("return page.tabs[6].worstRow()[0][0]")
    assert page.run("return page.state.set.wh") == worst


def test_a_circuit(bench: Any) -> None:
    """A deck beside the netlist runs in ngspice, and its waveforms are drawn."""
    page = bench("examples/relay/relay.net").open()
    assert page.run("return page.description.decks") == ["relay.cir"]
    page.tab("circuit")
    page.run("page.tabs[5].run.click()")
    page.wait("return page.tabs[5].answer || !page.tabs[5].note.innerText.includes('runs')")
    columns = page.run("return page.tabs[5].answer && page.tabs[5].answer.columns.map(c => [c.name, c.values.length])")
    assert columns, page.run("return page.tabs[5].note.innerText")
    assert columns[0][0] == "time" and columns[0][1] > 10 and len(columns) > 2


def test_an_edit_into_an_error_and_back(bench: Any, copies: Path) -> None:
    """An error is shown at its line and the last picture stays; the file is written on request alone, and not over changes of others."""
    file = copies / "arch/arch.net"
    page = bench(file).open()
    original = file.read_text()
    page.run("page.showEditor(true)")
    wrong = original.replace("beam2d", "beem2d", 1)
    line = wrong[: wrong.index("beem2d")].count("\n") + 1
    type_in = "page.editor.text.value = arguments[0]; page.editor.text.dispatchEvent(new Event('input'))"
    page.run(type_in, wrong)
    page.wait("return page.editor.marked.get(arguments[0]) === 'error'", line)
    assert f"line {line}" in page.run("return page.editor.messages.innerText")
    page.run(type_in, original.replace("param w = 2u", "param w = 3u"))
    expected = command("modes", file, "--set", "w=3u", "--count", "3")["frequencies_hz"]
    page.wait("return !page.failed && JSON.stringify(page.frequencies?.frequencies_hz) === JSON.stringify(arguments[0])", expected)
    assert file.read_text() == original, "nothing is written without a request"
    page.run("page.editor.saveButton.click()")
    page.wait("return page.editor.status.innerText === 'saved'")
    assert file.read_text() == original.replace("param w = 2u", "param w = 3u")
    file.write_text(original + "% another program was here\n")
    page.run(type_in, original.replace("param w = 2u", "param w = 4u"))
    page.run("page.editor.saveButton.click()")
    page.wait("return page.editor.status.innerText.includes('has changed')")
    assert file.read_text().endswith("% another program was here\n")


def test_a_beam_leads_to_its_line(bench: Any) -> None:
    """A selected beam shows its line of the netlist, forces, stress and share of the strain energy; the shares add up to one."""
    page = bench("examples/column/column.net", "--set", "F=100u").open()
    shares = page.run("return page.static.beams.map(b => b ? b[4] : 0)")
    assert sum(shares) == pytest.approx(1.0, abs=1e-12)
    page.run("page.figure.select(0)")
    place = page.run("return page.static.figure.places[0]")
    text = (ROOT / "examples/column/column.net").read_text().split("\n")[place[1] - 1].strip()
    assert "beam2d" in text
    shown = page.run("return page.beam.innerText")
    assert text in shown and "normal force" in shown and "% of all" in shown
    page.run("page.beam.querySelector('button').click()")
    assert page.run("return page.editor.text.value.slice(page.editor.text.selectionStart, page.editor.text.selectionEnd).trim()") == text
    # a column bears its load along its axis
    assert page.run("return page.static.beams[0][0]") == pytest.approx(-1e-4, rel=1e-3)
    for colour in ("temperature", "stress", "energy"):
        page.run("const c = page.tabs[0].colour; c.value = arguments[0]; c.dispatchEvent(new Event('change'))", colour)
    assert not page.run("return page.figure.bar.hidden")


def test_a_and_b(bench: Any) -> None:
    """The state kept as A stands beside the present one with the differences."""
    page = bench("examples/hot_arm/hot_arm.net").open()
    page.run("page.keep.click()")
    port = page.run("return page.description.ports[0].name")
    high = page.run("return page.description.ports[0].high")
    page.slide(port, high / 2)
    page.wait("return page.compare.innerText.includes('B − A')")
    assert page.run("return Boolean(page.figure.other)")
    page.run("page.keep.click()")
    assert page.run("return page.compare.innerText") == ""


def test_layouts_have_their_polygons(bench: Any, tmp_path: Path) -> None:
    """A CIF file shows the mechanism over its polygons, which the netlist of the layout places to within its grid."""
    out = tmp_path / "part.cif"
    subprocess.run([BIMORPH, "layout", "examples/comb_resonator/comb_resonator.net", "--out", out], cwd=ROOT, check=True, capture_output=True)
    page = bench(out).open()
    assert page.run("return page.failed && page.failed.message") is None
    page.wait("return page.figure.ground && page.figure.ground.layers.length")
    assert page.run("return page.editor.text.readOnly")
    contours = page.run("return Array.from(page.figure.ground.arrays.contours)")
    bounds = page.run("return page.static.figure.bounds")
    xs = contours[::2]
    assert min(xs) <= bounds[0] + 15e-6 and max(xs) >= bounds[2] - 15e-6


def test_an_export_needs_nothing_else(bench: Any, browser: Any, tmp_path: Path) -> None:
    """The exported page, of the command and of the page, shows its picture and moves its modes from one file without any request."""
    file = "examples/switch/switch.net"
    page = bench(file, "--port", "drive=15").open()
    page.wait("return page.pullIn")
    asks = {"describe": {"kind": "describe"}, "static": {"kind": "static"}, "frequencies": {"kind": "modes", "count": 3, "shapes": False}, "modes": {"kind": "modes", "count": 4, "shapes": True}}
    html = page.ask("export", {"kind": "export", "asks": asks, "view": {"ports": {"drive": 15}, "set": {}}})["text"]
    of_page, of_command = tmp_path / "page.html", tmp_path / "command.html"
    of_page.write_text(html)
    subprocess.run([BIMORPH, "view", file, "--port", "drive=15", "--export", of_command], cwd=ROOT, check=True, capture_output=True)
    expected = command("static", file, "--port", "drive=15")["nodes"]["a(8)"]["y"]
    for exported in (of_page, of_command):
        browser.get(exported.as_uri())
        page.wait("return page && page.static")
        assert page.run("return page.signal('a(8).y')") == expected
        page.tab("modes")
        first = page.run("return document.querySelector('.figure canvas').toDataURL()")
        page.wait("return document.querySelector('.figure canvas').toDataURL() !== arguments[0]", first)
        assert page.run("return performance.getEntriesByType('resource').length") == 0
    page.wait("return document.querySelector('.words').innerText.includes('pulls in at 17.84 V')")
    assert of_command.stat().st_size < 1_000_000


def test_keyboard_and_labels(bench: Any) -> None:
    """Each control has a name for a screen reader; tabs move by arrow keys; pictures have a description."""
    page = bench("examples/bank/bank.net").open()
    nameless = page.run(
        "return [...document.querySelectorAll('button, input, select, textarea, canvas')].filter(e => !e.closest('[hidden]') && "
        "!(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.textContent.trim() || (e.labels && e.labels.length))).map(e => e.outerHTML.slice(0, 120))"
    )
    assert nameless == []
    page.run("const t = document.getElementById('tab-static'); t.focus(); t.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}))")
    assert page.run("return document.activeElement.id") == "tab-modes"
    assert page.run("return document.getElementById('panel-static').hidden")
    page.run("const t = document.getElementById('tab-modes'); t.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowLeft', bubbles: true}))")
    label = page.wait("const l = document.querySelector('#panel-static canvas').getAttribute('aria-label'); return l.includes('from') && l")
    assert "path of equilibria" in label
    ratio = page.run(
        "const lum = c => { const [r, g, b] = c.match(/[\\d.]+/g).map(Number).map(x => { x /= 255; return x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4; }); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };"
        "const s = getComputedStyle(document.querySelector('.bench .note')), b = getComputedStyle(document.querySelector('.bench'));"
        "const [x, y] = [lum(s.color), lum(b.backgroundColor)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05)"
    )
    assert ratio >= 4.5, "WCAG 2.1, 1.4.3"


def test_the_processor_rests(bench: Any) -> None:
    """One second after the last event neither the bench nor a page without motion computes."""
    page = bench("examples/bank/bank.net").open()
    page.slide("heat", 2.0)
    time.sleep(1.0)
    before, frames = processor_time(page.process.pid), page.run("window.painted = 0; const old = page.figure.surface.paint; page.figure.surface.paint = (...a) => { window.painted += 1; old(...a); }; return 0")
    time.sleep(1.5)
    assert processor_time(page.process.pid) - before <= 0.03
    assert page.run("return window.painted") == frames


@pytest.mark.parametrize("wide, tall", [(1280, 720), (820, 1180)])
def test_the_page_fits(bench: Any, browser: Any, wide: int, tall: int) -> None:
    """Nothing is wider than the window, at 1280 × 720 and on a tablet."""
    page = bench("examples/bank/bank.net")
    browser.set_window_size(wide, tall)
    try:
        page.open()
        for tab in ("static", "modes", "path", "transient", "response", "circuit", "yield"):
            page.tab(tab)
            time.sleep(0.1)
            assert page.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth") <= 1, tab
    finally:
        browser.set_window_size(1280, 720)


def test_sugar_3(bench: Any, tmp_path: Path) -> None:
    """A SUGAR 3 netlist has its picture and a slider for its parameter, with the values of the command."""
    file = tmp_path / "chain.net"
    file.write_text(
        "-- beams in a row\np1 = material {Youngsmodulus=165e9, density=2300, h=2u}\nn = n or 2\n"
        'for k = 1, n do beam2d {node("c"..k), node("c"..(k + 1)), p1; l=50u, w=2u} end\n'
        'anchor {node "c1"; material=p1, l=5u, w=5u}\nf2d {node("c"..(n + 1)); F=1u, oz=-90}\n'
    )
    page = bench(file).open()
    assert {name: value for name, value in page.run("return page.static.nodes")} == nodes_of(command("static", file))
    page.slide("n", 3)
    assert {name: value for name, value in page.run("return page.static.nodes")} == nodes_of(command("static", file, "--set", "n=3"))


def test_the_scripts_are_a_widget(bench: Any, browser: Any, tmp_path: Path) -> None:
    """`render` of the same scripts shows the bench in a notebook, whose kernel passes its requests: here this test does."""
    import base64
    import http.client

    page = bench("examples/switch/switch.net")
    path = page.url.split(str(page.port), 1)[1]

    def request(method: str, place: str, body: str | None = None) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(page.host, page.port, timeout=30)
        connection.request(method, path + place, body, {"content-type": "application/json"} if body else {})
        reply = connection.getresponse()
        return reply.status, reply.read()

    notebook = tmp_path / "notebook.html"
    notebook.write_text("<!doctype html><meta charset=utf-8><title>notebook</title><div id=cell></div>")
    browser.get(notebook.as_uri())
    browser.execute_async_script(
        """
        const [script, style, done] = arguments;
        document.head.append(Object.assign(document.createElement('style'), {textContent: style}));
        window.requests = [];
        const model = {on: (name, heard) => { window.heard = heard; }, send: content => window.requests.push(content), get: () => '{}'};
        const url = URL.createObjectURL(new Blob([script], {type: 'text/javascript'}));
        import(url).then(module => { module.default.render({model, el: document.getElementById('cell')}); done(); });
        """,
        request("GET", "bench.js")[1].decode(),
        request("GET", "bench.css")[1].decode(),
    )
    end = time.monotonic() + 20
    while time.monotonic() < end and not browser.execute_script("return Boolean(document.getElementById('cell').bench.static)"):
        for content in browser.execute_script("return window.requests.splice(0)"):
            status, reply = request("POST", "ask", content["body"])
            browser.execute_script(
                "const [id, status, text] = arguments, bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));"
                "window.heard({id, status}, [new DataView(bytes.buffer)])",
                content["id"],
                status,
                base64.b64encode(reply).decode(),
            )
        time.sleep(0.02)
    nodes = browser.execute_script("return document.getElementById('cell').bench.static.nodes")
    assert {name: value for name, value in nodes} == nodes_of(command("static", "examples/switch/switch.net"))
    assert browser.execute_script("return document.querySelector('#cell canvas').clientWidth") > 100
