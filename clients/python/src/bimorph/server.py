"""A server for the time of a ``with`` block."""

from __future__ import annotations

import collections
import contextlib
import os
import shutil
import subprocess
import sysconfig
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


_held: set[IO[str]] = set()


def _let_go() -> None:
    """In a forked child: its copies of the pipes would keep the servers of its parent alive."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for pipe in _held:
        os.dup2(nothing, pipe.fileno(), inheritable=False)
    os.close(nothing)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)


@contextlib.contextmanager
def _folder() -> Iterator[str]:
    """A temporary folder that only the process that made it takes away."""
    owner, folder = os.getpid(), tempfile.mkdtemp(prefix="bimorph-")
    try:
        yield folder
    finally:
        if os.getpid() == owner:
            shutil.rmtree(folder, ignore_errors=True)


def program() -> str | None:
    """Path of the ``bimorph`` program: the environment variable ``BIMORPH_BIN``, else what was installed with this package, else from
    ``PATH``."""
    own = os.path.join(sysconfig.get_path("scripts"), "bimorph")
    return os.environ.get("BIMORPH_BIN") or shutil.which(own) or shutil.which("bimorph")


@contextlib.contextmanager
def serve(binary: str | None = None) -> Iterator[Server]:
    """Starts ``bimorph serve`` on a temporary Unix socket, and stops it at the end of the block.

    The server is this process's own: it ends with it, however it ends (also by ``SIGKILL`` or ``os._exit``), holds none of its
    files, and is not interrupted by Ctrl-C in its terminal. In a forked child, the end of the block leaves it alone.

    Raises :class:`Unavailable` when the program is not found or does not start; its last words are in the message.
    """
    binary = binary or program()
    if binary is None:
        raise Unavailable("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
    with _folder() as folder:
        address = f"unix://{folder}/s"
        try:
            # Standard input is a pipe that nobody writes to: it ends when this process does.
            process = subprocess.Popen(
                [binary, "serve", "--listen", address, "--while-stdin"],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )
        except OSError as error:
            raise Unavailable(f"{binary} cannot be started: {error}") from None
        assert process.stderr is not None and process.stdin is not None
        owner = os.getpid()
        _held.add(process.stdin)
        ready, said = threading.Event(), collections.deque[str](maxlen=20)
        listener = threading.Thread(target=_listen, args=(process.stderr, ready, said), daemon=True)
        listener.start()
        try:
            # The end of its words sets `ready` too, a moment before the process is seen to have ended.
            if not ready.wait(_START_S) or not any(line.startswith("listening on") for line in said):
                raise Unavailable(f"{binary} serve did not start: {''.join(said).strip() or 'no word from it'}")
            yield Server(address, process)
        finally:
            if os.getpid() == owner:
                _held.discard(process.stdin)
                _stop(process)
                listener.join(_STOP_S)
                process.stderr.close()


def _stop(process: subprocess.Popen[str]) -> None:
    if process.stdin is not None:
        process.stdin.close()
    process.terminate()
    try:
        process.wait(_STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _listen(lines: IO[str], ready: threading.Event, said: collections.deque[str]) -> None:
    """Reads what the server says, to its end: a full pipe would stop it."""
    for line in lines:
        said.append(line)
        if line.startswith("listening on"):
            ready.set()
    ready.set()
