"""The program, and a summary of what was run."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def program_path() -> str | None:
    """Path of the program, if it is built."""
    builds = [ROOT / "target" / kind / "bimorph" for kind in ("release", "debug")]
    found = os.environ.get("BIMORPH_BIN") or next((str(build) for build in builds if build.is_file()), shutil.which("bimorph"))
    return str(Path(found).resolve()) if found else None


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """How many blocks ran, by kind, and each one that did not."""
    from test_pages import REPORTS

    ran: dict[str, int] = {}
    for report in REPORTS.values():
        for kind, count in report.ran.items():
            ran[kind] = ran.get(kind, 0) + count
    elsewhere = [line for report in REPORTS.values() for line in report.elsewhere]
    not_run = [line for report in REPORTS.values() for line in report.not_run]
    terminalreporter.write_line(f"{len(REPORTS)} pages and help texts, {sum(ran.values())} blocks and commands run: " + ", ".join(f"{count} {kind}" for kind, count in sorted(ran.items())))
    terminalreporter.write_line(f"{len(elsewhere)} commands that build, install or measure: what they name is there, other steps of the tests run them")
    terminalreporter.write_line(f"{len(not_run)} not run")
    for line in not_run:
        terminalreporter.write_line(f"    {line}")
