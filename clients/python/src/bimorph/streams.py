"""Streams that stay open, over as many connections as they need: a server takes only so many on each (``streams_per_connection``).

A request beyond that number waits until another stream ends, which a session that is held open need not do.
"""

from __future__ import annotations

import threading

MAX_STREAMS = 128
"""Streams of a connection, where the server does not say how many it takes."""


class Place:
    """The place of a stream on a connection, given back once."""

    def __init__(self, places: Places, connection: int) -> None:
        self._places: Places | None = places
        self.connection = connection
        """Number of the connection, from 0."""

    def release(self) -> None:
        """Gives it back."""
        places, self._places = self._places, None
        if places is not None:
            places._release(self.connection)


class Places:
    """The places of the connections to one server."""

    def __init__(self) -> None:
        # an object that is collected in `take` gives its place back there
        self._lock = threading.RLock()
        self._taken: list[int] = []
        self.limit = MAX_STREAMS
        """Streams that the server takes on a connection."""

    def take(self) -> Place:
        """A place on the first connection that has one. On connection 0 a quarter is left to calls with one answer."""
        with self._lock:
            for connection, taken in enumerate([*self._taken, 0]):
                if taken < (self.limit - max(self.limit // 4, 1) if connection == 0 else self.limit):
                    break
            else:
                # a server that takes one stream on each connection: the first has calls alone
                self._taken.append(0)
                connection = len(self._taken)
            while len(self._taken) <= connection:
                self._taken.append(0)
            self._taken[connection] += 1
            return Place(self, connection)

    def _release(self, connection: int) -> None:
        with self._lock:
            self._taken[connection] -= 1
