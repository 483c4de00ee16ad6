"""Tables as local files or in an object store, by the file systems of Arrow or fsspec."""

from __future__ import annotations

import errno
import os
from typing import TYPE_CHECKING, Any

from . import arguments

if TYPE_CHECKING:
    import pyarrow


def to_parquet(table: pyarrow.Table, path: str | os.PathLike[str], filesystem: Any = None) -> None:
    """Writes a Parquet file, as a whole or not at all.

    ``path`` belongs to ``filesystem``; without one it is a local path, or a URI such as ``s3://bucket/mc.parquet``.

    Raises :class:`OSError` if the file system rejects it.
    """
    try:
        from pyarrow import fs, parquet
    except ImportError:
        raise ImportError("to_parquet() needs pyarrow: pip install pyarrow") from None
    place = arguments.path("path", path, "a path, or the URI of a file")
    if filesystem is not None:
        if not (isinstance(filesystem, fs.FileSystem) or hasattr(filesystem, "protocol") and hasattr(filesystem, "open")):
            raise arguments.wrong_type("filesystem", "a file system of pyarrow.fs or of fsspec, or None", filesystem)
        store = filesystem if isinstance(filesystem, fs.FileSystem) else fs.PyFileSystem(fs.FSSpecHandler(filesystem))
    elif "://" in place:
        try:
            store, place = fs.FileSystem.from_uri(place)
        except (ValueError, TypeError) as error:
            raise arguments.wrong("path", f"a path, or the URI of a file ({error})", path) from None
    else:
        store = fs.LocalFileSystem()
    # object stores publish a file when it is complete; elsewhere it is renamed then
    is_here = isinstance(store, (fs.LocalFileSystem, fs.SubTreeFileSystem))
    written = f"{place}.part" if is_here else place
    try:
        parquet.write_table(table, written, filesystem=store)
        if is_here:
            store.move(written, place)
    except BaseException as error:
        if is_here and store.get_file_info(written).type == fs.FileType.File:
            store.delete_file(written)
        if isinstance(error, OSError):
            raise OSError(error.errno or errno.EIO, f"path: {error.strerror or error}", place) from None
        raise
