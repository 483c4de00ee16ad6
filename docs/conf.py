"""Settings of Sphinx for this manual. `make docs` builds it (scripts/docs)."""

import sys
import tomllib
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path.insert(0, str(DOCS / "extension"))

project = "Bimorph"
author = "the Bimorph authors"
project_copyright = author
release = version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]

extensions = ["myst_parser", "sphinx_design", "sphinx.ext.autodoc", "netlist_lexer", "protocol", "outside_links"]
myst_enable_extensions = ["colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4
exclude_patterns = ["extension", "requirements.txt"]
highlight_language = "text"
nitpicky = False
# Options such as --band keep their dashes.
smartquotes = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": True}
python_maximum_signature_line_length = 100

html_theme = "furo"
html_title = f"Bimorph {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
if tags.has("pdf"):  # noqa: F821, from Sphinx: a plain page for scripts/docs-pdf
    html_theme, html_theme_options, html_css_files = "basic", {}, ["print.css"]
