"""A browser without a window, and benches that it opens."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

ROOT = Path(__file__).resolve().parents[2]
BIMORPH = ROOT / "target/release/bimorph"
PATIENCE = 30.0
"""Longest time until a page shows what is waited for [s]."""
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--window-size=1280,720",
)


class Bench:
    """A process `bimorph view` with its page."""

    def __init__(self, browser: Any, process: subprocess.Popen[str], url: str) -> None:
        self.browser, self.process, self.url = browser, process, url
        self.host, self.port = urlparse(url).hostname, urlparse(url).port

    def open(self, fragment: str = "") -> Bench:
        """Opens the page and waits for its first picture."""
        self.browser.get("about:blank")
        self.browser.get(self.url + fragment)
        self.wait("return Boolean(page && page.description && (page.static || page.failed))")
        return self

    def run(self, script: str, *values: Any) -> Any:
        """Runs a script of the page, in which `page` is the bench."""
        return self.browser.execute_script("const page = document.getElementById('bench')?.bench;" + script, *values)

    def wait(self, script: str, *values: Any) -> Any:
        """Waits until a script returns a true value, and returns it."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            found = self.run(script, *values)
            if found:
                return found
            time.sleep(0.02)
        words = self.run("return document.body.innerText.slice(0, 2000)")
        raise AssertionError(f"not within {PATIENCE} s: {script}\nthe page shows:\n{words}")

    def ask(self, channel: str, ask: dict[str, Any]) -> dict[str, Any]:
        """An answer by the transport of the page, without its arrays."""
        script = (
            "const done = arguments[arguments.length - 1]; const page = document.getElementById('bench').bench;"
            "page.transport.ask(arguments[0], page.state, arguments[1]).then(a => done(typeof a === 'string' ? {text: a} : {...a, arrays: null}),"
            "error => done({error: error.message, refusal: error.refusal}))"
        )
        return self.browser.execute_async_script(script, channel, ask)

    def slide(self, name: str, value: float) -> None:
        """Types a value beside a slider, as a person does, and waits for the picture of it."""
        self.run(
            "const box = document.querySelector(`.slider[data-name=\"${arguments[0]}\"] input.number`);"
            "window.pictured = false; page.root.addEventListener('picture', () => { window.pictured = true; }, {once: true});"
            "box.value = arguments[1]; box.dispatchEvent(new Event('change'))",
            name,
            repr(value),
        )
        self.wait("return window.pictured")

    def end(self) -> None:
        """Ends the bench as the end of the process that started it does."""
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            assert pipe is not None
            pipe.close()
        assert self.process.wait(10) == 0

    def tab(self, name: str) -> None:
        self.run("document.getElementById(`tab-${arguments[0]}`).click()", name)


def started(browser: Any, file: object, *options: object) -> Bench:
    """A bench of a file, which ends when its standard input ends."""
    words = [str(BIMORPH), "view", str(file), "--no-browser", "--while-stdin", *map(str, options)]
    process = subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stderr is not None
    url = process.stdout.readline().strip()
    assert url.startswith("http://127.0.0.1:"), (url, process.stderr.read())
    return Bench(browser, process, url)


def command(*words: object) -> dict[str, Any]:
    """The JSON document of a command."""
    done = subprocess.run([BIMORPH, *map(str, words), "--json"], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """Chromium without a window, with a profile of its own."""
    folder = tempfile.mkdtemp(prefix="bimorph-browser-")
    options = webdriver.ChromeOptions()
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    assert program and driver, "Chromium and its driver are missing: scripts/setup browser"
    options.binary_location = program
    for flag in (*FLAGS, f"--user-data-dir={folder}/profile"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    found = webdriver.Chrome(options=options, service=Service(driver))
    found.set_script_timeout(PATIENCE)
    try:
        yield found
    finally:
        found.quit()
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """One browser for all tests."""
    with chromium() as found:
        yield found


@pytest.fixture
def bench(browser: Any) -> Iterator[Any]:
    """Starts benches: `bench(file, option, …)`. None may leave a message of the browser's console."""
    running: list[Bench] = []

    def start(file: object, *options: object) -> Bench:
        running.append(started(browser, file, *options))
        return running[-1]

    yield start
    faults = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE" and "favicon" not in entry["message"]]
    browser.get("about:blank")
    for one in running:
        one.end()
    browser.get_log("browser")
    expected = ("409", "422")
    assert not [fault for fault in faults if not any(f"status of {status}" in fault for status in expected)], faults


@pytest.fixture
def copies(tmp_path: Path) -> Path:
    """A copy of the examples that a test may change."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("*.rs"))
    return tmp_path / "examples"


def processor_time(pid: int) -> float:
    """Processor time of a process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
