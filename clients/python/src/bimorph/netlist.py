"""Netlists as they are sent: the text of a file with the text of every file it includes."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

_USES = re.compile(r"^\s*uses\b([^%\r\n]*)", re.MULTILINE)


@dataclass(frozen=True)
class Netlist:
    """A netlist that needs no disk.

    The server opens no files of its own: what is not in ``files`` is reported as a missing include.
    """

    root: str
    """Name of the root file, as diagnostics show it."""
    files: Mapping[str, str] = field(repr=False)
    """Text of each file by the name under which it is included."""

    @classmethod
    def read(cls, path: str | os.PathLike[str], include: Iterable[str | os.PathLike[str]] = ()) -> Netlist:
        """Reads ``path`` and every file it ``uses``.

        A name is looked up beside the file that includes it, then in the working directory, then in ``include``.
        """
        path = Path(path)
        files = {str(path): _text(path)}
        waiting = [(str(path), path.parent)]
        while waiting:
            name, folder = waiting.pop()
            for match in _USES.finditer(files[name]):
                spelled = match.group(1).strip()
                places = [folder, Path(), *map(Path, include)]
                found = next((p / spelled for p in places if spelled and (p / spelled).is_file()), None)
                if found is not None and spelled not in files and found.resolve() != path.resolve():
                    files[spelled] = _text(found)
                    waiting.append((spelled, found.parent))
        return cls(str(path), files)

    @classmethod
    def text(cls, text: str, name: str = "netlist.net") -> Netlist:
        """A netlist given as text, without includes of its own."""
        return cls(name, {name: text})


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", errors="replace")
