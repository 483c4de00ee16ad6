"""Replies of devices."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TrialReply:
    """Reply of a device to port voltages. Matrices are indexed by names: ``di_dv["heat"]["sense"]``."""

    token: int
    """Token of the new state; 0 if ``need_dt`` is set."""
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
    """Values of the opened signals, each in its unit."""
    doutputs_dv: dict[str, dict[str, float]]
    """∂output/∂voltage [unit/V]."""
    dt_next: float
    """Longest next step that is likely to succeed [s]; infinite without a bound."""
    jumped: bool
    """Whether a static trial passed a limit point: pull-in, release or snap-through."""
    need_dt: float | None
    """Longest step for another trial [s], if the step was too long; None otherwise. With it no other field is valid."""
    voltages: dict[str, float]
    """Input of each port [V, or the unit of its kind]."""
