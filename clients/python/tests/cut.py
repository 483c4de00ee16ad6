"""A way to a server that can be cut: a TCP proxy in this process."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator


class Cut:
    """Carries bytes between clients and ``target`` (host, port) until it is cut."""

    def __init__(self, target: tuple[str, int]) -> None:
        self._target = target
        self._dead: set[tuple[socket.socket, socket.socket]] = set()
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self._listener.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def silence(self) -> None:
        """From now on nothing passes on the connections there are, without a notice; new ones are whole."""
        self._dead.update(self._pairs)

    def reset(self) -> None:
        """Breaks the connections there are."""
        for client, server in self._pairs:
            for end in (client, server):
                with contextlib.suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Ends all of it."""
        self._listener.close()
        self.reset()

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            pair = (client, socket.create_connection(self._target))
            self._pairs.append(pair)
            for here, there in (pair, pair[::-1]):
                threading.Thread(target=self._carry, args=(pair, here, there), daemon=True).start()

    def _carry(self, pair: tuple[socket.socket, socket.socket], here: socket.socket, there: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := here.recv(65536):
                if pair not in self._dead:
                    there.sendall(data)
            there.shutdown(socket.SHUT_RDWR)


@contextlib.contextmanager
def cut(target: tuple[str, int]) -> Iterator[Cut]:
    """A way for the time of a ``with`` block."""
    way = Cut(target)
    try:
        yield way
    finally:
        way.close()
