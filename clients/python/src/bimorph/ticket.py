"""States of sessions, as values that can be pickled."""

from __future__ import annotations

from dataclasses import dataclass, field

from .trial_reply import TrialReply


@dataclass(frozen=True)
class Snapshot:
    """Accepted state of a session. :meth:`Model.restore` continues from it with bit-identical results, also on another server."""

    model: str
    """Id of the model."""
    states: bytes = field(repr=False)
    """Serialised states of the server."""
    accepted: TrialReply | None
    """The accepted state."""
    t: float
    """Time of the accepted state [s]."""
    voltages: dict[str, float]
    """Accepted port voltages [V]."""


@dataclass(frozen=True)
class Ticket:
    """Reference to a kept session of a server. :meth:`Client.resume` continues it, also after a restart of the server."""

    model: str
    """Id of the model."""
    session: str
    """Id of the session. Any client that has it can use the session."""
    accepted: TrialReply | None
    """The accepted state."""
    t: float
    """Time of the accepted state [s]."""
    voltages: dict[str, float]
    """Accepted port voltages [V]."""
