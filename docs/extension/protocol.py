"""Writes the reference of the gRPC protocol from the comments of proto/bimorph/v1 where a page has the mark `<!-- protocol -->`."""

import re
from pathlib import Path

PROTOCOL = Path(__file__).resolve().parents[2] / "proto" / "bimorph" / "v1"
MARK = "<!-- protocol -->"


def cells(text):
    """Text in a cell of a table: angle brackets and bars are no markup there."""
    return text.replace("|", "\\|").replace("<", "&lt;").replace("[", "\\[").replace("*", "\\*").replace("_", "\\_")


def plain(text):
    return text.replace("<", "&lt;").replace("[", "\\[").replace("*", "\\*").replace("_", "\\_")


class File:
    """One .proto file as blocks of Markdown: services, messages and enumerations with the comments before or behind each line."""

    def __init__(self, path):
        self.path, self.out = path, []
        self.comment, self.rows, self.open = [], [], []
        for line in path.read_text().splitlines():
            self.line(line.strip())

    def line(self, line):
        if line.startswith("//"):
            self.comment.append(line.lstrip("/").strip())
            return
        code, _, behind = line.partition("//")
        code = code.strip()
        about = " ".join([*self.comment, behind.strip()] if behind else self.comment)
        if begun := re.fullmatch(r"(service|message|enum|oneof) (\w+) \{(\}?)", code):
            self.begin(begun[1], begun[2], about)
            if begun[3]:
                self.end()
        elif code == "}":
            self.end()
        elif call := re.fullmatch(r"rpc (\w+)\s*\((stream )?([\w.]+)\) returns \((stream )?([\w.]+)\)\s*[;{]\}?;?", code):
            sent, got = (("stream of " if s else "") + f"`{name}`" for s, name in ((call[2], call[3]), (call[4], call[5])))
            self.rows.append((f"`{call[1]}`", f"{sent} → {got}", about))
        elif field := re.fullmatch(r"(?:(repeated|optional) )?([\w.]+|map<[^>]+>) (\w+) = (\d+).*;", code):
            inside = [name for kind, name in self.open if kind == "oneof"]
            kind = " ".join(filter(None, [field[1], field[2]]))
            self.rows.append((f"`{field[3]}`", f"`{kind}`" + (f", one of `{inside[0]}`" if inside else ""), about))
        elif value := re.fullmatch(r"(\w+) = (\d+).*;", code):
            self.rows.append((f"`{value[1]}`", value[2], about))
        elif code and not re.match(r"syntax|package|import|option|reserved|\}", code):
            raise ValueError(f"{self.path.name}: not read: {code}")
        if not code.startswith("rpc") or code.endswith((";", "}")):
            self.comment = []

    def begin(self, kind, name, about):
        if kind != "oneof":
            self.flush()
            outer = ".".join(outer for kind, outer in self.open)
            name = f"{outer}.{name}" if outer else name
            self.out.append(f"### {kind} {name}\n\n{plain(about)}\n")
        self.open.append((kind, name))
        self.comment = []

    def end(self):
        if self.open and self.open.pop()[0] != "oneof":
            self.flush()

    def flush(self):
        if self.rows:
            head = "| name | form | meaning |\n|---|---|---|\n"
            self.out.append(head + "".join(f"| {a} | {b} | {cells(c)} |\n" for a, b, c in self.rows))
            self.rows = []


def markdown():
    """All files, that of the service first."""
    files = sorted(PROTOCOL.glob("*.proto"), key=lambda path: (path.name != "service.proto", path.name))
    return "\n".join(f"## {path.name}\n\n" + "\n".join(File(path).out) for path in files)


def replace(_app, _page, source):
    if MARK in source[0]:
        source[0] = source[0].replace(MARK, markdown())


def setup(app):
    app.connect("source-read", replace)
    return {"parallel_read_safe": True}
