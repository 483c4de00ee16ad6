"""Pages as Jupyter notebooks: text, files, commands and Python in cells, with the output that they had when the page was run."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

from blocks import FENCE, Block, blocks, pictures, steps
from runner import ROOT, Page, Report

PICTURE = re.compile(r"\]\(\.\./pictures/([\w.-]+)\)")
KINDS = {".svg": "image/svg+xml", ".png": "image/png"}


class Recorded(Page):
    """A page that keeps what each block printed, by the line of the block."""

    def __init__(self, name: str, folder: Path, program: str) -> None:
        super().__init__(name, folder, program)
        self.printed: dict[int, str] = {}
        shell, self._line = self.shell.run, 0

        def run(command: str) -> tuple[int, str]:
            code, output = shell(command)
            self.printed[self._line] = self.printed.get(self._line, "") + output.replace(f"{folder}/", "")
            return code, output

        self.shell.run = run  # type: ignore[method-assign]

    def _console(self, block: Block) -> None:
        self._line = block.line
        super()._console(block)

    def _python(self, block: Block) -> None:
        self._line, self.last_output = block.line, ""
        super()._python(block)
        if self.last_output:
            self.printed[block.line] = self.last_output


def _stream(text: str) -> list[dict[str, object]]:
    """The output of a cell."""
    return [{"output_type": "stream", "name": "stdout", "text": text}] if text else []


def _code(source: str, output: str, number: int) -> dict[str, object]:
    return {"cell_type": "code", "metadata": {}, "execution_count": number, "source": source, "outputs": _stream(output), "id": f"cell{number}"}


def _text(source: str, number: int, folder: Path, drawn: dict[str, str]) -> dict[str, object]:
    """A cell of text, with the pictures that the page drew in it."""
    attachments: dict[str, dict[str, str]] = {}
    for name in PICTURE.findall(source):
        file = folder / drawn[name] if name in drawn else ROOT / "docs/pictures" / name
        attachments[name] = {KINDS[file.suffix]: base64.b64encode(file.read_bytes()).decode()}
    source = PICTURE.sub(r"](attachment:\1)", source)
    cell: dict[str, object] = {"cell_type": "markdown", "metadata": {}, "source": source, "id": f"cell{number}"}
    return cell | ({"attachments": attachments} if attachments else {})


def notebook(path: Path, folder: Path, program: str) -> tuple[dict[str, object], Report]:
    """Runs a page and makes a notebook of it, with the results in it."""
    page = Recorded(str(path.relative_to(ROOT)), folder, program)
    found = blocks(path)
    report = page.run(found)
    drawn = pictures(path)
    by_line = {block.line: block for block in found}
    lines, cells, text, k = path.read_text().split("\n"), [], [], 0

    def flush() -> None:
        source = "\n".join(text).strip()
        text.clear()
        if source:
            cells.append(_text(source, len(cells), folder, drawn))

    while k < len(lines):
        fence = FENCE.match(lines[k])
        block = by_line.get(k + 2) if fence else None
        if fence is None:
            text.append(lines[k])
            k += 1
            continue
        end = next((j for j in range(k + 1, len(lines)) if lines[j] == fence[1]), len(lines))
        if block is None:
            if fence[2] != "text":
                text.extend(lines[k : end + 1])
        else:
            flush()
            if block.kind == "console":
                source = "%%bash\n" + "\n".join(command for _, command, _ in steps(block.text))
            elif block.name:
                source = f"%%writefile {block.name}\n{block.text}"
            else:
                source = block.text
            printed = page.printed.get(block.line, "") if block.kind in ("console", "python") and not block.name else ""
            cells.append(_code(source, printed, len(cells)))
        k = end + 1
    flush()
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}, "language_info": {"name": "python"}}
    return {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}, report


def write(path: Path, folder: Path, program: str, out: Path) -> Report:
    """Writes the notebook of a page."""
    document, report = notebook(path, folder, program)
    out.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    return report
