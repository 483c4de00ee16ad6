"""A server that belongs to this process, for a ``with`` block or from :meth:`Server.start` to :meth:`Server.close`."""

from __future__ import annotations

import atexit
import collections
import contextlib
import os
import shutil
import subprocess
import tempfile
import threading
from types import TracebackType
from typing import IO

from . import arguments
from .client import Client
from .errors import BimorphError, Unavailable
from .program import program

_START_S = 30.0
_STOP_S = 15.0
_RECONNECT_S = 5.0

_running: set[Server] = set()
"""Running servers of this process. They are closed at the end of the interpreter, while its threads still run."""


class Server:
    """``bimorph serve`` on a temporary Unix socket.

    It ends with this process, in whichever way that ends (also by ``SIGKILL`` or ``os._exit``). It inherits no files and is not
    interrupted by Ctrl-C in the terminal. In a forked child :meth:`close` has no effect.

    A ``with`` block closes it at the end. In a notebook, it runs from :meth:`start` to :meth:`close` or to the end of the interpreter.
    """

    def __init__(self, binary: str | os.PathLike[str] | None = None) -> None:
        """``binary`` is the program, by default the one that :func:`program` finds."""
        self._binary = None if binary is None else arguments.path("binary", binary, "the path of the program bimorph")
        self._lock = threading.RLock()
        self._running: _Running | None = None
        self._process: subprocess.Popen[str] | None = None

    @property
    def address(self) -> str:
        """``unix:///path`` of its socket.

        Raises :class:`BimorphError` if it is not running.
        """
        return self._held().address

    @property
    def process(self) -> subprocess.Popen[str]:
        """The process; after :meth:`close` that of the last run."""
        if self._process is None:
            raise _not_started()
        return self._process

    def start(self) -> Server:
        """Starts it unless it is running; returns this object.

        Raises :class:`Unavailable` if the program is not found or does not start; the message has its last output.
        """
        with self._lock:
            held = self._running
            if held is not None and (held.owner != os.getpid() or held.process.poll() is not None):
                self.close()
                held = None
            if held is None:
                self._running = _Running(self._binary or program())
                self._process = self._running.process
                _running.add(self)
        return self

    def close(self) -> None:
        """Stops it; it can be started again."""
        with self._lock:
            held, self._running = self._running, None
            _running.discard(self)
            if held is not None:
                held.close()

    def client(self, timeout: float = 120.0) -> Client:
        """A client of this server; ``timeout`` [s] bounds each unary call."""
        client = Client(self.address, timeout)
        # a new server has another address: do not wait long for one that has ended
        client._channel.reconnect = _RECONNECT_S
        return client

    def _held(self) -> _Running:
        held = self._running
        if held is None:
            raise _not_started()
        ended = held.process.poll() if held.owner == os.getpid() else None
        if ended is not None:
            how = f"by signal {-ended}" if ended < 0 else f"with exit status {ended}"
            raise Unavailable(f"server {held.address}: its process has ended {how}; start() starts it again")
        return held

    def __enter__(self) -> Server:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        held = self._running
        return f"<Server at {held.address}>" if held is not None else "<Server, not running>"


def _not_started() -> BimorphError:
    return BimorphError("the server does not run; start() it, or use it in a `with` block")


def serve(binary: str | os.PathLike[str] | None = None) -> Server:
    """Starts a :class:`Server`, to be used in a ``with`` block or closed with :meth:`Server.close`.

    Raises :class:`Unavailable` if the program is not found or does not start.
    """
    return Server(binary).start()


class _Running:
    """A process of a server."""

    def __init__(self, binary: str | None) -> None:
        if binary is None:
            raise Unavailable("the program bimorph was not found; set BIMORPH_BIN to its path, or put it on PATH")
        self.owner = os.getpid()
        self._folder = tempfile.mkdtemp(prefix="bimorph-")
        self.address = f"unix://{self._folder}/s"
        try:
            # Only this process writes to standard input, so the server sees its end when this process ends.
            self.process = subprocess.Popen(
                [binary, "serve", "--listen", self.address, "--while-stdin"],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                start_new_session=True,
            )
        except OSError as error:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise Unavailable(f"binary: {binary} cannot be started: {error}") from None
        assert self.process.stderr is not None and self.process.stdin is not None
        _pipes.add(self.process.stdin)
        ready, lines = threading.Event(), collections.deque[str](maxlen=20)
        self._listener = threading.Thread(target=_listen, args=(self.process.stderr, ready, lines), daemon=True)
        try:
            self._listener.start()
            # The end of the output sets `ready` too, before `poll` reports the end of the process.
            if not ready.wait(_START_S) or not any(line.startswith("listening on") for line in lines):
                raise Unavailable(f"binary: {binary} serve did not start: {''.join(lines).strip() or 'it printed nothing'}")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Ends the process and removes its folder; has no effect in a forked child."""
        if os.getpid() != self.owner:
            return
        process = self.process
        assert process.stderr is not None and process.stdin is not None
        _pipes.discard(process.stdin)
        with contextlib.suppress(OSError):
            process.stdin.close()
        process.terminate()
        try:
            process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        with contextlib.suppress(RuntimeError):
            self._listener.join(_STOP_S)
        if not self._listener.is_alive():
            process.stderr.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def _listen(lines: IO[str], ready: threading.Event, last: collections.deque[str]) -> None:
    """Reads the output of the server to its end, because a full pipe would block it."""
    for line in lines:
        last.append(line)
        if line.startswith("listening on"):
            ready.set()
    ready.set()


_pipes: set[IO[str]] = set()
"""Standard inputs of the servers of this process."""


@atexit.register
def _end() -> None:
    for server in list(_running):
        server.close()


def _forked() -> None:
    """In a forked child: closes its copies of the pipes, which would keep the servers of the parent alive."""
    _running.clear()
    nothing = os.open(os.devnull, os.O_RDWR)
    for pipe in _pipes:
        os.dup2(nothing, pipe.fileno(), inheritable=False)
    os.close(nothing)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)
