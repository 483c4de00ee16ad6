"""The live bench of a model in a notebook: the page of ``bimorph view`` as a widget of anywidget.

The widget and the page have the same scripts, which the program gives. Requests of the widget go through the kernel to a process
``bimorph view`` beside it, so that a browser on another machine needs no other connection.
"""

from __future__ import annotations

import contextlib
import functools
import http.client
import json
import os
import shutil
import subprocess
import tempfile
import weakref
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import urlsplit

from .errors import BimorphError, Unavailable
from .messages import setting_value
from .options import WIRE
from .program import program

_REQUEST_S = 600.0
_STOP_S = 10.0
_WORKERS = 6
_FOLDERS = 10
"""Folders above the netlist, which the names of its includes may leave by ``..``."""


def view_of(source: Any, voltages: dict[str, float], height: int) -> Any:
    """The widget of the netlist and options of a ``CompileRequest``, with port voltages to begin with [V] and a height in pixels."""
    try:
        kind = _widget()
    except ImportError:
        raise ImportError("view() needs anywidget: pip install anywidget") from None
    return kind(BenchProcess(source, voltages), height)


class BenchProcess:
    """``bimorph view`` on the files of a netlist. It ends with this process, or with :meth:`close`."""

    def __init__(self, source: Any, voltages: dict[str, float]) -> None:
        binary = program()
        if binary is None:
            raise Unavailable("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
        self._folder = tempfile.mkdtemp(prefix="bimorph-view-")
        try:
            file = _written(source.bundle, Path(self._folder))
            words = [binary, "view", str(file), "--no-browser", "--while-stdin", "--include", str(file.parent)]
            words += _options(source.options)
            for name, volts in voltages.items():
                words += ["--port", f"{name}={volts!r}"]
            self.process = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
            )
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise
        assert self.process.stdout is not None and self.process.stderr is not None
        self.url = self.process.stdout.readline().strip()
        if not self.url:
            reason = self.process.stderr.read().strip()
            self.close()
            raise BimorphError(f"bimorph view did not start: {reason or 'it printed nothing'}")
        self._end = weakref.finalize(self, _ended, self.process, self._folder)

    def request(self, method: str, place: str, body: str | None = None) -> tuple[int, bytes]:
        """Status and body of a reply."""
        parts = urlsplit(self.url)
        connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=_REQUEST_S)
        try:
            connection.request(method, parts.path + place, body, {"content-type": "application/json"} if body else {})
            response = connection.getresponse()
            return response.status, response.read()
        finally:
            connection.close()

    def close(self) -> None:
        """Ends the process and removes its files."""
        _ended(self.process, self._folder)


def _ended(process: subprocess.Popen[str], folder: str) -> None:
    for pipe in (process.stdin, process.stdout, process.stderr):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    try:
        process.wait(_STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    shutil.rmtree(folder, ignore_errors=True)


def _written(bundle: Any, folder: Path) -> Path:
    """Writes the files of a bundle under their names; returns the path of its root."""
    place = folder.joinpath(*["netlist"] * _FOLDERS)
    place.mkdir(parents=True)
    root = place / PurePosixPath(bundle.root).name
    for name, text in bundle.files.items():
        path = root if name == bundle.root else Path(os.path.normpath(place / name))
        if not path.is_relative_to(folder):
            raise BimorphError(f"view: the netlist includes {name!r}, which lies beside no netlist: give it a relative name")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return root


def _options(options: Any) -> list[str]:
    """The options of a ``CompileRequest`` as words of the command."""
    words: list[str] = []
    for setting in options.set:
        value = setting_value(setting)
        words += ["--set", f"{setting.name}={value!r}"]
    given = {field.name: value for field, value in options.ListFields()}
    for name, wire in WIRE.items():
        if wire in given:
            flag = "--" + name.replace("_", "-")
            words += [flag] if given[wire] is True else [flag, str(given[wire])]
    return words


@functools.cache
def _widget() -> type[Any]:
    """The class of the widget; anywidget is imported at first use."""
    import anywidget
    import traitlets

    class BenchWidget(anywidget.AnyWidget):
        """The live bench of a model. :meth:`close` ends its process."""

        _esm = traitlets.Unicode("").tag(sync=True)
        _css = traitlets.Unicode("").tag(sync=True)
        view = traitlets.Unicode("{}").tag(sync=True)

        def __init__(self, bench: BenchProcess, height: int) -> None:
            script, style = (bench.request("GET", name)[1].decode() for name in ("bench.js", "bench.css"))
            self._bench = bench
            self._workers = ThreadPoolExecutor(_WORKERS, thread_name_prefix="bimorph-view")
            super().__init__(_esm=script, _css=f"{style}\n.bench-notebook {{ height: {int(height)}px; }}")
            self.on_msg(self._received)

        def _received(self, _: Any, content: Any, __: Any) -> None:
            """A request of the page. It runs beside others, because a newer one stops an older one of its kind."""
            self._workers.submit(self._answered, content["id"], content["body"])

        def _answered(self, number: int, body: str) -> None:
            try:
                status, reply = self._bench.request("POST", "ask", body)
            except OSError:
                status, reply = 503, json.dumps({"error": "the bench has ended: run the cell again"}).encode()
            self.send({"id": number, "status": status}, buffers=[reply])

        def close(self) -> None:
            """Ends the process of the bench, and removes the widget."""
            self._workers.shutdown(wait=False, cancel_futures=True)
            self._bench.close()
            super().close()

    return BenchWidget
