"""Netlists with their includes: the text of a file and of every file that it includes."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from .arguments import content, items, mapping, wrong, wrong_type
from .arguments import path as a_path
from .arguments import text as the_text

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
    """Two different files are included under one name; the one included first is used."""


@dataclass(frozen=True)
class Netlist:
    """A netlist in memory.

    The server opens no files: an include that is not in ``files`` is reported as missing.
    """

    root: str
    """Name of the root file in diagnostics."""
    files: Mapping[str, str] = field(repr=False)
    """Text of each file by the name under which it is included."""

    def __post_init__(self) -> None:
        the_text("root", self.root, "the name of a file")
        files = mapping("files", self.files, "texts of files by their names")
        for name, content in files.items():
            the_text("files: name of a file", name, "a text")
            if not isinstance(content, str):
                raise wrong_type(f"files[{name!r}]", "the text of a file", content)
        if self.root not in files:
            raise wrong("root", f"the name of one of the files, {', '.join(map(repr, files)) or 'none'}", self.root)

    @classmethod
    def read(cls, path: str | os.PathLike[str], include: Iterable[str | os.PathLike[str]] = ()) -> Netlist:
        """Reads ``path`` and every file it ``uses``.

        As in the command, a name is searched for beside the file that includes it, then in the working
        directory, then in the folders of ``include``. Each name is read once, at its first occurrence. A
        :class:`DroppedInclude` warning is issued if another file of the same name is skipped.
        """
        return cls._read("path", path, include)

    @classmethod
    def _read(cls, argument: str, given: str | os.PathLike[str], include: Iterable[str | os.PathLike[str]]) -> Netlist:
        """As :meth:`read`, with the name of the argument for errors."""
        path = Path(a_path(argument, given, "the path of a netlist"))
        root = str(path)
        files = {root: content(argument, path).decode("utf-8", errors="replace")}
        found: dict[str, Path] = {}
        places = items("include", include, "a list of folders")
        folders = [Path(), *(Path(a_path(f"include[{k}]", one, "the path of a folder")) for k, one in enumerate(places))]

        def includes(name: str, folder: Path, depth: int) -> None:
            for spelled in _uses(files[name]):
                places = (place / spelled for place in (folder, *folders))
                file = next((place for place in places if place.is_file()), None)
                if spelled in files:
                    if file is not None and spelled in found and not _same(file, found[spelled]):
                        text = f"{file} is left out: {name} includes it as {spelled!r}, which is {found[spelled]} already"
                        warnings.warn(text, DroppedInclude, stacklevel=2)
                    continue
                # one more than allowed of each, so that the server reports the excess
                if file is None or len(files) > _MOST + 1 or depth > _DEEPEST or _same(file, path):
                    continue
                files[spelled], found[spelled] = _text(file), file
                includes(spelled, file.parent, depth + 1)

        includes(root, path.parent, 0)
        return cls(root, files)

    @classmethod
    def text(cls, text: str, name: str = "netlist.net") -> Netlist:
        """A netlist given as text, without includes of its own."""
        if not isinstance(text, str):
            raise wrong_type("text", "the text of a netlist", text)
        return cls(the_text("name", name, "the name of a file"), {name: text})


def _text(path: Path) -> str:
    return path.read_bytes().decode("utf-8", errors="replace")


def _uses(text: str) -> list[str]:
    """The names of the files that a text includes, in order."""
    return [match["file"] for match in _WORDS.finditer(text) if match["file"]]


def _same(a: Path, b: Path) -> bool:
    return a.resolve() == b.resolve()
