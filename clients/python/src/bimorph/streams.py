"""Distribution of long-lived streams over connections: a server limits the streams of each connection (``streams_per_connection``).

A stream beyond that limit waits for the end of another one, which may never come.
"""

from __future__ import annotations

import threading

MAX_STREAMS = 128
"""Default of the most streams of a connection."""


class Place:
    """A slot for a stream on a connection; it is released once."""

    def __init__(self, places: Places, connection: int) -> None:
        self._places: Places | None = places
        self.connection = connection
        """Number of the connection, from 0."""

    def release(self) -> None:
        """Releases the slot."""
        places, self._places = self._places, None
        if places is not None:
            places._release(self.connection)


class Places:
    """Stream slots of the connections to one server."""

    def __init__(self) -> None:
        # an object that is collected during `take` releases its slot there
        self._lock = threading.RLock()
        self._taken: list[int] = []
        self.limit = MAX_STREAMS
        """Most streams of a connection."""

    def take(self) -> Place:
        """A slot on the first connection with a free one. On connection 0 a quarter is reserved for unary calls."""
        with self._lock:
            for connection, taken in enumerate([*self._taken, 0]):
                if taken < (self.limit - max(self.limit // 4, 1) if connection == 0 else self.limit):
                    break
            else:
                # with a limit of one stream the first connection has only unary calls
                self._taken.append(0)
                connection = len(self._taken)
            while len(self._taken) <= connection:
                self._taken.append(0)
            self._taken[connection] += 1
            return Place(self, connection)

    def _release(self, connection: int) -> None:
        with self._lock:
            self._taken[connection] -= 1
