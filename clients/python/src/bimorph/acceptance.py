"""Accepted states of several sessions, replaced together."""

from __future__ import annotations

import collections
import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

from .errors import BimorphError

if TYPE_CHECKING:
    from .session import Session
    from .trial_reply import TrialReply

State = tuple["Session", "TrialReply", dict[str, float]]
"""A session, the reply whose state it accepts, and the values of its ports there."""


def accept_together(states: Sequence[State], *, warn: bool = True) -> None:
    """Accepts a state of each session: of all of them or, where this raises, of none. ``warn``: their warnings come with the next replies.

    A kept session is accepted on its server first. If one of several cannot be, the states before are accepted again there.
    """
    asked: list[Session] = []
    try:
        for session, reply, _ in states:
            if session.kept:
                asked.append(session)
                session._report_accepted(reply, warn=warn)
            else:
                session._usable()
    except BaseException:
        for session in asked:
            if session.accepted is not None:
                with contextlib.suppress(BimorphError):
                    session._report_accepted(session.accepted, warn=False)
        raise
    changes = [change for session, reply, voltages in states for change in _changes(session, reply, voltages)]
    # In C throughout: no interrupt of the main thread comes between two of the assignments.
    collections.deque(map(setattr, *zip(*changes)), maxlen=0) if changes else None
    for session, reply, _ in states:
        if not session.kept:
            # It only frees memory on the server. A stream that has ended is reported by the next call.
            with contextlib.suppress(BimorphError):
                session._report_accepted(reply, warn=warn)


def _changes(session: Session, reply: TrialReply, voltages: dict[str, float]) -> list[tuple[Session, str, object]]:
    return [(session, "accepted", reply), (session, "t", reply.t), (session, "_voltages", voltages)]
