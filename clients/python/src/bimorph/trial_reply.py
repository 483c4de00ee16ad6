"""What a device answers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TrialReply:
    """What a device answers to port voltages. Matrices are by name: ``di_dv["heat"]["sense"]``."""

    token: int
    """Names the new state; 0 when ``need_dt`` is set."""
    t: float
    """Time of the state [s]."""
    currents: dict[str, float]
    """Conduction current into each port [A]."""
    charges: dict[str, float]
    """Charge on each port [C]; the port current is the current plus the rate of this."""
    di_dv: dict[str, dict[str, float]]
    """∂current/∂voltage [S]."""
    dq_dv: dict[str, dict[str, float]]
    """∂charge/∂voltage [F], with the mechanical response over this step."""
    outputs: dict[str, float]
    """Opened signals, each in its unit."""
    doutputs_dv: dict[str, dict[str, float]]
    """∂output/∂voltage [unit/V]."""
    dt_next: float
    """Longest next step likely to be accepted [s]; infinite when the device does not care."""
    jumped: bool
    """A static trial passed a fold: pulled in, or let go."""
    need_dt: float | None
    """Set when the step was too long: ask again with at most this [s]. Nothing else holds then."""
    voltages: dict[str, float]
    """What was given to each port [V, or the unit of its kind]."""
