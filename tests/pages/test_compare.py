"""The comparison notices a wrong digit, a wrong word and a missing line."""

from __future__ import annotations

import pytest
from compare import differs


@pytest.mark.parametrize(
    ("shown", "obtained"),
    [
        ("f 96.92 kHz", "f   96.92 kHz"),
        ("f 96.92 kHz", "f 96.93 kHz"),
        ("a\n…\nd 4", "a\nb\nc\nd 4"),
        ("done in … s", "done in 0.31 s"),
        ("1.5e-6 … 3.14", "1.5e-6 and 7 then 3.14"),
        ("", "anything"),
    ],
)
def test_agrees(shown: str, obtained: str) -> None:
    """The same to the last digit shown."""
    assert not differs(shown, obtained)


@pytest.mark.parametrize(
    ("shown", "obtained"),
    [
        ("f 96.92 kHz", "f 96.95 kHz"),
        ("f 96.92 kHz", "f 96.92 MHz"),
        ("f 96.92 kHz", "f 96.92"),
        ("3 beams", "4 beams"),
        ("a", "a\nb"),
        ("a\n…\nd 4", "a\nb\nd 5"),
        ("1.5e-6 …", "1.5e-5 x"),
        ("-1.5 µm", "1.5 µm"),
        ("1.5 µm …", "1.9 µm x"),
    ],
)
def test_differs(shown: str, obtained: str) -> None:
    """Anything else is noticed."""
    assert differs(shown, obtained)
