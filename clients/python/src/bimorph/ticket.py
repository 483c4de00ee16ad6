"""Where a session stands, as values that can be pickled."""

from __future__ import annotations

from dataclasses import dataclass, field

from .trial_reply import TrialReply


@dataclass(frozen=True)
class Snapshot:
    """Where a session stands: from here :meth:`Model.restore` goes on with the same bits, also on another server."""

    model: str
    """Id of the model."""
    states: bytes = field(repr=False)
    """The server's bytes."""
    accepted: TrialReply | None
    """The accepted state."""
    t: float
    """Its time [s]."""
    voltages: dict[str, float]
    """Accepted port voltages [V]."""


@dataclass(frozen=True)
class Ticket:
    """Where a kept session stands on its server: :meth:`Client.resume` goes on there, also when the server was started anew."""

    model: str
    """Id of the model."""
    session: str
    """Id of the session: who has it may use it."""
    accepted: TrialReply | None
    """The accepted state."""
    t: float
    """Its time [s]."""
    voltages: dict[str, float]
    """Accepted port voltages [V]."""
