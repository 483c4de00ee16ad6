"""Netlists as they are sent: the text of a file with the text of every file it includes."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

_WORDS = re.compile(
    r"""%[^\n]*                                # a comment
      | "[^"\n]*"? | '[^'\n]*'?                # a string
      | (?<![A-Za-z0-9_])uses(?![A-Za-z0-9_])[ \t\r\n\f]*(?P<file>[^ \t\r\n\f]*)
      | [A-Za-z0-9_]+
    """,
    re.VERBOSE,
)
_DEEPEST = 10
_MOST = 40


class DroppedInclude(UserWarning):
    """Two different files are included under one name; the first that the text meets is the one that counts."""


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

        The rule is that of the command: a name is looked up beside the file that includes it, then in the working
        directory, then in the folders of ``include``. Each spelled name is read once, where the text meets it first; a
        :class:`DroppedInclude` warning tells when that leaves out a different file.
        """
        path = Path(path)
        root = str(path)
        files = {root: _text(path)}
        found: dict[str, Path] = {}
        folders = [Path(), *map(Path, include)]

        def includes(name: str, folder: Path, depth: int) -> None:
            for spelled in _uses(files[name]):
                places = (place / spelled for place in (folder, *folders))
                file = next((place for place in places if place.is_file()), None)
                if spelled in files:
                    if file is not None and spelled in found and not _same(file, found[spelled]):
                        text = f"{file} is left out: {name} includes it as {spelled!r}, which is {found[spelled]} already"
                        warnings.warn(text, DroppedInclude, stacklevel=2)
                    continue
                # one more than allowed on each count, so that the server sees that there are too many
                if file is None or len(files) > _MOST + 1 or depth > _DEEPEST or _same(file, path):
                    continue
                files[spelled], found[spelled] = _text(file), file
                includes(spelled, file.parent, depth + 1)

        includes(root, path.parent, 0)
        return cls(root, files)

    @classmethod
    def text(cls, text: str, name: str = "netlist.net") -> Netlist:
        """A netlist given as text, without includes of its own."""
        return cls(name, {name: text})


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", errors="replace")


def _uses(text: str) -> list[str]:
    """The names of the files that a text includes, in order."""
    return [match["file"] for match in _WORDS.finditer(text) if match["file"]]


def _same(a: Path, b: Path) -> bool:
    return a.resolve() == b.resolve()
