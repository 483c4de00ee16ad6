"""The blocks of a page that a reader would type, in the order in which they stand."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(r"^(`{3,})(\S*) *(.*)$")
FILE = re.compile(r"`([\w./-]+\.(?:net|cir|cif|py|csv|toml|lib|inc|sp))`[^`]*:$")
NOT_RUN = re.compile(r"^<!-- not run: (.+) -->$")
WARNS = re.compile(r"^<!-- warns: (W\d{3}(?:, W\d{3})*) -->$")
"""Warnings of the netlist that follows, which its page explains."""
COMMAND = re.compile(r"^(bimorph |printf |grep |cat |openssl |chmod |cmp |ngspice |cd |export |make |cargo |scripts/|benches/|taskset |pip |\((?:cat|echo) )")
"""Words that begin a command in an indented block or in the examples of a help text."""


@dataclass
class Block:
    """One thing to run."""

    kind: str
    """``console``, ``command`` (output not shown), ``python``, ``netlist``, ``lua``, ``deck``, ``file``."""
    line: int
    """Where it begins, from 1."""
    text: str
    name: str = ""
    """The file that a block is, if the line before it names one."""
    output: str | None = None
    """The output shown: of Python, in the ``text`` block that follows."""
    not_run: str = ""
    """Why it is not run."""
    warns: tuple[str, ...] = ()
    """Codes of warnings that a netlist may have."""


def blocks(page: Path) -> list[Block]:
    """Every block of a page."""
    lines = page.read_text().split("\n")
    found: list[Block] = []
    before, reason, codes, k = "", "", (), 0
    while k < len(lines):
        line = lines[k]
        fence = FENCE.match(line)
        if fence:
            end = next((j for j in range(k + 1, len(lines)) if lines[j] == fence[1]), len(lines))
            _fenced(found, fence[2], k + 2, "\n".join(lines[k + 1 : end]), before, reason)
            if codes:
                found[-1].warns = codes
            before, reason, codes, k = "", "", (), end + 1
        elif line.startswith("    ") and not before.lstrip().startswith(("*", "-")) and (k == 0 or not lines[k - 1].strip()):
            end = next((j for j in range(k, len(lines)) if lines[j].strip() and not lines[j].startswith("    ")), len(lines))
            _indented(found, k + 1, [text[4:] for text in lines[k:end]], before, reason)
            before, reason, k = "", "", end
        else:
            if line.strip():
                remark, warned = NOT_RUN.match(line), WARNS.match(line)
                if warned:
                    codes = tuple(warned[1].split(", "))
                    k += 1
                    continue
                before, reason = (before, remark[1]) if remark else (line, "")
            k += 1
    return found


def _fenced(found: list[Block], language: str, line: int, text: str, before: str, reason: str) -> None:
    """Adds a fenced block."""
    name = FILE.search(before.strip())
    if language == "text" and not name:
        if found and found[-1].kind == "python" and found[-1].output is None and before == "":
            found[-1].output = text
    elif language in ("console", "python", "netlist", "lua"):
        found.append(Block(language, line, text, name[1] if name else "", None, reason))
    elif name:
        found.append(Block("file", line, text, name[1], None, reason))
    elif text.rstrip().endswith("\n.end"):
        found.append(Block("deck", line, text, "", None, reason))


def _indented(found: list[Block], line: int, lines: list[str], before: str, reason: str) -> None:
    """Adds the commands of an indented block, or the deck that it is."""
    while lines and not lines[-1].strip():
        lines.pop()
    text = "\n".join(lines)
    if lines[-1].strip() == ".end":
        name = FILE.search(before.strip())
        found.append(Block("deck", line, text, name[1] if name else "", None, reason))
        return
    for k, command in commands(lines):
        found.append(Block("command", line + k, command, "", None, reason))


def commands(lines: list[str]) -> list[tuple[int, str]]:
    """The commands among lines, each with the index of its line."""
    return [(k, line.strip()) for k, line in enumerate(lines) if COMMAND.match(line.strip())]


def steps(text: str) -> list[tuple[int, str, str]]:
    """The commands of a console block: line within it from 0, command, output shown."""
    found: list[list] = []
    for k, line in enumerate(text.split("\n")):
        if line.startswith("$ "):
            found.append([k, line[2:], []])
        elif found and not found[-1][2] and (line.startswith("> ") or found[-1][1].endswith("\\")):
            found[-1][1] += "\n" + line.removeprefix("> ")
        elif found:
            found[-1][2].append(line)
    return [(k, command, "\n".join(output).strip("\n")) for k, command, output in found]


def pictures(page: Path) -> dict[str, str]:
    """The pictures that a page draws itself: name in docs/pictures, and the file that a command of the page writes."""
    names = re.findall(r"\]\(\.\./pictures/([\w.-]+)\)", page.read_text())
    return {name: name.removeprefix(f"{page.stem}_") for name in names if name.startswith(f"{page.stem}_")}
