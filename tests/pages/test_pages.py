"""Everything documented runs: commands, decks, netlists and Python of the pages, and the examples of every help text, in an empty folder with
`examples` in it; output that a page shows is the one obtained, to the digits shown."""

from __future__ import annotations

import os
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest
from conftest import program_path
from runner import ROOT, Report, documented, help_text, page, subcommands

REPORTS: dict[str, Report] = {}
"""What became of each page that was run."""
PROGRAM = program_path()
PAGES = {str(path.relative_to(ROOT)): path for path in documented()}
HELPS = {" ".join(["bimorph", *words, "--help"]): words for words in [[], *([name] for name in subcommands(PROGRAM))]} if PROGRAM else {}


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> dict[str, Future[Report]]:
    """Every requested page, in parallel on the cores of this machine."""
    if not PROGRAM:
        pytest.skip("the program bimorph is not built: cargo build --release --workspace, or set BIMORPH_BIN")
    wanted = {item.callspec.params["name"] for item in request.session.items if hasattr(item, "callspec") and "name" in item.callspec.params}
    pool = ThreadPoolExecutor(max_workers=max(2, os.cpu_count() or 1))
    jobs: dict[str, Future[Report]] = {}
    for name, path in PAGES.items():
        if name in wanted:
            jobs[name] = pool.submit(page, path, Path(tmp_path_factory.mktemp("page")), PROGRAM)
    for name, words in HELPS.items():
        if name in wanted:
            jobs[name] = pool.submit(help_text, words, Path(tmp_path_factory.mktemp("help")), PROGRAM)
    return jobs


@pytest.mark.parametrize("name", [*PAGES, *HELPS])
def test_page(name: str, running: dict[str, Future[Report]]) -> None:
    """A page, or the examples of a help text."""
    report = REPORTS[name] = running[name].result()
    assert not report.failures, "\n\n".join(report.failures)
