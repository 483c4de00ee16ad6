"""A server for the time of a ``with`` block."""

from __future__ import annotations

import collections
import contextlib
import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from typing import IO

from .client import Client
from .errors import Unavailable

_START_S = 30.0
_STOP_S = 15.0


class Server:
    """A running server that was started here."""

    def __init__(self, address: str, process: subprocess.Popen[str]) -> None:
        self.address = address
        """``unix:///path`` of its socket."""
        self.process = process
        """The process."""

    def client(self, timeout: float = 120.0) -> Client:
        """A client of this server; ``timeout`` [s] bounds each unary call."""
        return Client(self.address, timeout)


def program() -> str | None:
    """Path of the ``bimorph`` program: the environment variable ``BIMORPH_BIN``, else from ``PATH``."""
    return os.environ.get("BIMORPH_BIN") or shutil.which("bimorph")


@contextlib.contextmanager
def serve(binary: str | None = None) -> Iterator[Server]:
    """Starts ``bimorph serve`` on a temporary Unix socket, and stops it at the end of the block.

    Raises :class:`Unavailable` when the program is not found or does not start; its last words are in the message.
    """
    binary = binary or program()
    if binary is None:
        raise Unavailable("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
    with tempfile.TemporaryDirectory(prefix="bimorph-") as folder:
        address = f"unix://{folder}/s"
        try:
            process = subprocess.Popen(
                [binary, "serve", "--listen", address], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
            )
        except OSError as error:
            raise Unavailable(f"{binary} cannot be started: {error}") from None
        assert process.stderr is not None
        ready, said = threading.Event(), collections.deque[str](maxlen=20)
        listener = threading.Thread(target=_listen, args=(process.stderr, ready, said), daemon=True)
        listener.start()
        try:
            # The end of its words sets `ready` too, a moment before the process is seen to have ended.
            if not ready.wait(_START_S) or not any(line.startswith("listening on") for line in said):
                raise Unavailable(f"{binary} serve did not start: {''.join(said).strip() or 'no word from it'}")
            yield Server(address, process)
        finally:
            process.terminate()
            try:
                process.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            listener.join(_STOP_S)
            process.stderr.close()


def _listen(lines: IO[str], ready: threading.Event, said: collections.deque[str]) -> None:
    """Reads what the server says, to its end: a full pipe would stop it."""
    for line in lines:
        said.append(line)
        if line.startswith("listening on"):
            ready.set()
    ready.set()
