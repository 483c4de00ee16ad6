"""Runs what a page documents, as its reader would: one folder, one shell and one Python for each page."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from blocks import Block, blocks, commands, pictures, steps
from compare import differs

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0
"""Longest time that a page may take [s]."""
EXIT = re.compile(r"#.*\bexit status (\d+)\s*$")
"""The remark behind a command that is meant to fail."""
ELSEWHERE = re.compile(r"^(make|cargo|scripts/|benches/|taskset|systemctl|pip|sbatch|kubectl|podman|docker|git|apt|sudo|cd bimorph)\b|^bimorph export .*--osdi\b")
"""Commands that install, build, measure, or belong to other machines: other tests run these, and what they name must be there."""
PORTS = (50051, 9464)
"""Ports of pages and settings, in whose place a server of a test takes free ones."""
OPTIONAL = {"gdsfactory": "gdsfactory", "bimorph.local()": "bimorph._native", "to_pandas()": "pandas", "to_xarray()": "xarray"}
"""Modules that a Python block may need and a machine may lack, by a word of the block."""


@dataclass
class Report:
    """What became of a page."""

    ran: Counter[str] = field(default_factory=Counter)
    elsewhere: list[str] = field(default_factory=list)
    not_run: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


class Shell:
    """A shell that lives as long as its page, in a process group that ends with it."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.folder, self.count = folder, 0
        self.process = subprocess.Popen(["bash", "--norc"], cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)

    def run(self, command: str) -> tuple[int, str]:
        """Exit status and output, both streams as a terminal shows them."""
        self.count += 1
        output = self.folder / f".output{self.count}"
        assert self.process.stdin and self.process.stdout
        try:
            self.process.stdin.write(f"{{ {command}\n}} >{output} 2>&1 </dev/null; printf 'done %s\\n' $?\n")
            self.process.stdin.flush()
            for line in self.process.stdout:
                if line.startswith("done "):
                    return int(line.split()[1]), output.read_text(errors="replace")
        except BrokenPipeError:
            pass
        printed = output.read_text(errors="replace") if output.is_file() else ""
        return -1, f"{printed}\n(the shell ended, or the page took more than {PATIENCE:.0f} s)"

    def end(self) -> None:
        """Ends the shell and what it started."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()


DRIVER = """
import contextlib, io, json, sys, traceback
space = {"__name__": "__main__"}
channel = sys.stdout
for line in sys.stdin:
    block = json.loads(line)
    text, failure = io.StringIO(), ""
    with contextlib.redirect_stdout(text):
        try:
            exec(compile("\\n" * (block["line"] - 1) + block["code"], block["page"], "exec"), space)
        except BaseException:
            failure = traceback.format_exc()
    print(json.dumps({"output": text.getvalue(), "failure": failure}), file=channel, flush=True)
"""


class Interpreter:
    """A Python that keeps its names from block to block of a page, with warnings of the product as errors."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        words = [sys.executable, "-u", "-c", DRIVER]
        self.errors = (folder / ".errors").open("w+")
        self.process = subprocess.Popen(words, cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, text=True, start_new_session=True)

    def run(self, page: str, line: int, code: str) -> tuple[str, str]:
        """Printed text, and the traceback of a failure."""
        assert self.process.stdin and self.process.stdout
        try:
            self.process.stdin.write(json.dumps({"page": page, "line": line, "code": code}) + "\n")
            self.process.stdin.flush()
            reply = self.process.stdout.readline()
        except BrokenPipeError:
            reply = ""
        if not reply:
            self.errors.seek(0)
            return "", "Python ended: " + self.errors.read()[-2000:]
        reply = json.loads(reply)
        return reply["output"], reply["failure"]

    def end(self) -> None:
        """Ends it and what it started."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        self.errors.close()


class Page:
    """One page, or the examples of one help text, in a folder of its own."""

    def __init__(self, name: str, folder: Path, program: str) -> None:
        self.name, self.folder, self.report = name, folder, Report()
        shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("*.rs"))
        self.ports = {f":{port}": f":{_free_port()}" for port in PORTS}
        for settings in (folder / "examples").rglob("*.toml"):
            settings.write_text(self._on_free_ports(settings.read_text()))
        path = folder / ".bin"
        path.mkdir()
        (path / "bimorph").symlink_to(program)
        (path / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        (path / "python").chmod(0o755)
        client = importlib.util.find_spec("bimorph")
        package = [str(Path(client.origin).parents[1])] if client and client.origin else []
        library = Path(program).with_name("libbimorph_ngspice.so")
        self.environment = {
            **os.environ,
            "BIMORPH": str(ROOT),
            "PATH": os.pathsep.join([str(path), os.environ["PATH"]]),
            "PYTHONPATH": os.pathsep.join([*package, *filter(None, [os.environ.get("PYTHONPATH", "")])]),
            "BIMORPH_BIN": program,
            "MPLBACKEND": "Agg",
            "PYTHONWARNINGS": "error::UserWarning:__main__",
            **({"BIMORPH_CM": str(library)} if library.is_file() and "BIMORPH_CM" not in os.environ else {}),
        }
        self.shell = Shell(folder, self.environment)
        self.python: Interpreter | None = None
        self.decks = 0
        self.last_output = ""
        self.replies: dict[str, str] = {}

    def run(self, found: list[Block]) -> Report:
        """Runs the blocks in order; a page that takes too long is ended, which is a failure."""
        late = threading.Timer(PATIENCE, self.end)
        late.start()
        try:
            for block in found:
                if block.not_run:
                    self.report.not_run.append(f"{self.name}:{block.line}: {block.not_run}")
                else:
                    getattr(self, f"_{block.kind}")(block)
        finally:
            late.cancel()
            self.end()
        return self.report

    def end(self) -> None:
        """Ends what the page started."""
        self.shell.end()
        if self.python:
            self.python.end()

    def _fail(self, line: int, what: str, why: str) -> None:
        self.report.failures.append(f"{self.name}:{line}: {what}\n{why[-3000:]}")

    def _execute(self, line: int, command: str, shown: str) -> None:
        """Runs a command of the shell, and compares its output where some is shown."""
        if ELSEWHERE.match(command):
            self._named(line, command)
            return
        wanted = EXIT.search(command)
        if re.match(r"bimorph serve\b.*:\d", command):
            self.ports |= {f":{port}": f":{_free_port()}" for port in PORTS}
        command = self._on_free_ports(command.replace("/tmp/", f"{self.folder}/"))
        if "JOB" in command and "job" in self.replies:
            command = command.replace("JOB", self.replies["job"])
        if re.match(r"bimorph serve\b", command) and "--help" not in command and not wanted:
            command = self._in_background(command, "listening on")
        if re.match(r"bimorph view\b", command) and "--help" not in command and "--export" not in command and not wanted:
            command = self._in_background(command, "http://127.0.0.1")
        code, output = self.shell.run(command)
        job = re.search(r"\bjobs/[0-9a-f]{32}\b", output)
        if job:
            self.replies["job"] = job[0]
        if code != (int(wanted[1]) if wanted else 0):
            self._fail(line, command, f"exit status {code}\n{output}")
            return
        difference = differs(shown, output.replace(f"{self.folder}/", "/tmp/") if "/tmp/" in shown else output.replace(f"{self.folder}/", ""))
        if difference:
            self._fail(line, command, difference)
            return
        self.report.ran["commands, output compared" if shown else "commands"] += 1

    def _on_free_ports(self, text: str) -> str:
        for port, free in self.ports.items():
            text = text.replace(port, free)
        return text

    def _in_background(self, command: str, ready: str) -> str:
        """A server is started, and has to say where it listens: `ready` is in its output then."""
        log = self.folder / f".server{self.shell.count}"
        command = re.sub(r"(\s#.*)?(\s&)?\s*$", "", command)
        wait = f"for k in $(seq 200); do grep -q '{ready}' {log} && break; kill -0 $! 2>/dev/null || break; sleep 0.05; done; cat {log}; grep -q '{ready}' {log}"
        # the output exists before the server does
        return f": >{log}; {command} >>{log} 2>&1 & {wait}"

    def _named(self, line: int, command: str) -> None:
        """A command that is not run here: the scripts, targets and examples that it names are there."""
        words = command.split("#")[0].split()
        for script in [word for word in words if word.startswith(("scripts/", "benches/", "examples/")) and "*" not in word]:
            if not (ROOT / script).exists():
                self._fail(line, command, f"{script} does not exist")
                return
        if words[0] == "make":
            missing = [word for word in words[1:] if "=" not in word and not re.search(rf"^{word}:", (ROOT / "Makefile").read_text(), re.MULTILINE)]
            if missing:
                self._fail(line, command, f"the Makefile has no {missing}")
                return
        self.report.elsewhere.append(f"{self.name}:{line}: {command}")

    def _command(self, block: Block) -> None:
        self._execute(block.line, block.text, "")

    def _console(self, block: Block) -> None:
        for k, command, shown in steps(block.text):
            self._execute(block.line + k, command, shown)

    def _file(self, block: Block) -> None:
        target = self.folder / block.name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(block.text + "\n")
        self.report.ran["files written"] += 1

    def _netlist(self, block: Block) -> None:
        self._check(block, ".net")

    def _lua(self, block: Block) -> None:
        self._check(block, ".net")

    def _check(self, block: Block, extension: str) -> None:
        """A netlist loads without a warning that its page does not explain."""
        name = block.name or f"block{block.line}{extension}"
        target = self.folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(block.text + "\n")
        code, output = self.shell.run(f"bimorph check {name}")
        if code or (not block.name and set(re.findall(r"warning\[(W\d+)\]", output)) - set(block.warns)):
            self._fail(block.line, f"bimorph check {name}", output)
        else:
            self.report.ran["netlists"] += 1

    def _deck(self, block: Block) -> None:
        """A deck that no line names runs as it is."""
        if block.name:
            self._file(block)
            return
        self.decks += 1
        name = f"deck{self.decks}.cir"
        (self.folder / name).write_text(block.text + "\n")
        code, output = self.shell.run(f"bimorph cosim {name} -q --out {name}.raw")
        if code:
            self._fail(block.line, f"bimorph cosim {name}", output)
        else:
            self.report.ran["decks"] += 1

    def _python(self, block: Block) -> None:
        missing = [module for word, module in OPTIONAL.items() if word in block.text and importlib.util.find_spec(module) is None]
        if missing:
            self.report.not_run.append(f"{self.name}:{block.line}: the module {missing[0]} is not installed")
            return
        if block.name:
            self._file(block)
        if re.search(r"^def test_", block.text, re.MULTILINE):
            name = block.name or f"test_block{block.line}.py"
            if not block.name:
                (self.folder / name).write_text(block.text + "\n")
                code, output = self.shell.run(f"{sys.executable} -m pytest -q -p no:cacheprovider {name}")
                if code:
                    self._fail(block.line, "pytest", output)
                    return
        elif not block.name:
            self.python = self.python or Interpreter(self.folder, self.environment)
            output, failure = self.python.run(self.name, block.line, block.text)
            self.last_output = output
            difference = failure or (differs(block.output, output) if block.output is not None else "")
            if difference:
                self._fail(block.line, "Python", difference)
                return
        self.report.ran["Python blocks" if block.output is None else "Python blocks, output compared"] += 1


def _free_port() -> int:
    """A port that nothing listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def page(path: Path, folder: Path, program: str) -> Report:
    """Runs a page."""
    report = Page(str(path.relative_to(ROOT)), folder, program).run(blocks(path))
    for picture, file in pictures(path).items():
        if not (folder / file).is_file():
            report.failures.append(f"{path.relative_to(ROOT)}: shows {picture}, but no command writes {file}")
    return report


def help_text(words: list[str], folder: Path, program: str) -> Report:
    """Runs the examples of a help text."""
    text = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True).stdout
    head, _, examples = text.partition("\nExamples:\n")
    lines = examples.split("\n\n")[0].split("\n")
    name = " ".join(["bimorph", *words, "--help"])
    found = [Block("command", k + 1, command) for k, command in commands(lines)]
    return Page(name, folder, program).run(found)


def subcommands(program: str) -> list[str]:
    """The subcommands of the program."""
    text = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    listed = text.partition("\nCommands:\n")[2].split("\n\n")[0]
    return [word for word in re.findall(r"^  ([a-z]+)  ", listed, re.MULTILINE) if word != "help"]


def documented() -> list[Path]:
    """Every page with something to run, from the index of the repository."""
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted((ROOT / "examples").rglob("*.md")), *sorted((ROOT / "clients").glob("*/README.md"))]
    return [path for path in found if path.is_file() and "node_modules" not in path.parts]
