"""The installed program."""

from __future__ import annotations

import os
import shutil
import sysconfig


def program() -> str | None:
    """Path of the ``bimorph`` program: from the environment variable ``BIMORPH_BIN``, else installed with this package, else from
    ``PATH``."""
    own = os.path.join(sysconfig.get_path("scripts"), "bimorph")
    return os.environ.get("BIMORPH_BIN") or shutil.which(own) or shutil.which("bimorph")
