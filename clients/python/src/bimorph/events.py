"""Events of a transient, and statistics after a contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .arguments import items, number, text, wrong, wrong_type
from .results import Crossing, Statistics
from .v1 import analysis_pb2

Until = str | tuple[str, float]
"""``"contact"``, ``"release"``, or a signal with the level that it crosses, in its unit."""


def until_to_wire(until: Until | None) -> Any:
    """Message of the event that ends a run; None without one."""
    expected = '"contact", "release" or (signal, level)'
    if until is None:
        return None
    if not isinstance(until, (str, tuple, list)):
        raise wrong_type("until", expected, until)
    match until:
        case "contact":
            return analysis_pb2.Until(contact=True)
        case "release":
            return analysis_pb2.Until(release=True)
        case (str(name), level):
            value = number("until", level, f"{expected} with a finite level,")
            return analysis_pb2.Until(crossing=analysis_pb2.Named(name=text("until", name, "the name of a signal"), value=value))
    raise wrong("until", expected, until)


def events_to_wire(events: Sequence[tuple[str, float]]) -> list[Any]:
    """Messages of the crossings to find."""
    expected = "a signal with the level that it crosses, as (\"tip.y\", -1e-6)"
    found = []
    for k, event in enumerate(items("events", events, f"a list of events, each {expected}")):
        where = f"events[{k}]"
        if not isinstance(event, (tuple, list)) or len(event) != 2:
            raise wrong_type(where, expected, event)
        found.append(analysis_pb2.Named(name=text(where, event[0], expected), value=number(where, event[1], f"{expected} with a finite level,")))
    return found


def crossing(one: Any) -> Crossing:
    """A crossing from its message."""
    return Crossing(one.signal, one.level, one.t, one.up, one.contact)


def statistics(one: Any) -> Statistics:
    """Statistics of a signal from their message."""
    return Statistics(one.signal, one.from_s, one.to_s, one.mean, one.mean_error, one.rms, one.low, one.high)
