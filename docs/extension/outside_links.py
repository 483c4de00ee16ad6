"""Links to Markdown files outside docs/ work on a code host. The site has no such pages, and names the file instead."""

import re
from pathlib import Path

LINK = re.compile(r"(?<!!)\[([^]]*)\]\(((?:\.\./)+[^)#\s]+\.md)(?:#[^)\s]*)?\)")


def replace(app, page, source):
    folder = Path(app.srcdir, page).parent

    def name(link):
        target = (folder / link[2]).resolve()
        inside = target.is_relative_to(Path(app.srcdir).resolve())
        return link[0] if inside else f"`{target.relative_to(Path(app.srcdir).resolve().parent)}`"

    source[0] = LINK.sub(name, source[0])


def setup(app):
    app.connect("source-read", replace)
    return {"parallel_read_safe": True}
