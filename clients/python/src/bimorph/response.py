"""Conversion of frequency responses from messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .messages import estimate_of
from .results import FrequencyResponse, Root

SPACINGS: dict[str, Any] = {"log": 0, "decade": 1, "linear": 2}
"""Frequency spacings by name."""


def response_of(answer: Any, drive: str) -> FrequencyResponse:
    """The response from a verified message."""

    def roots(wire: Iterable[Any]) -> list[Root]:
        return [Root(complex(root.re, root.im)) for root in wire]

    return FrequencyResponse(
        drive=drive,
        drive_unit=answer.drive_unit,
        frequencies_hz=np.array(answer.frequencies_hz, dtype=np.float64),
        signals={s.name: np.array(s.re, dtype=np.float64) + 1j * np.array(s.im, dtype=np.float64) for s in answer.signals},
        units={s.name: s.unit for s in answer.signals},
        at_rest={s.name: s.at_rest if s.HasField("at_rest") else None for s in answer.signals},
        poles=roots(answer.poles) if answer.poles_known else None,
        zeros={s.name: roots(s.zeros) if s.zeros_known else None for s in answer.signals},
        points_added=answer.points_added,
        modes=answer.modes or None,
        modal_error=answer.modal_error if answer.HasField("modal_error") else None,
        unknowns=answer.unknowns,
        estimated_error=estimate_of(answer),
        warnings=tuple(answer.warnings),
    )
