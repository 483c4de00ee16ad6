"""The four ways to pull-in and release of random gap-closing parts agree: the first parts of `scripts/gap-parts`, which compares 200."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("law", ["none", "parallel", "exact", "sugar"])
def test_analyses_agree_on_random_parts(law):
    """`pullin`, `path`, statics in sequence and `.dc` of ngspice agree within 1e-3 on five parts, one of each kind."""
    command = [sys.executable, ROOT / "scripts/gap-parts", "--count", "5", "--law", law]
    run = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.startswith("5 parts: 5 agree within 0.001")
