"""The output that a page shows, against the one obtained: words alike, numbers to the digits shown, `…` for what is left out."""

from __future__ import annotations

import re

NUMBER = re.compile(r"(?<![\w.])([-−+]?\d+(?:\.\d+)?)(?:e([-+]?\d+))?")
LEFT_OUT = "…"


def differs(shown: str, obtained: str) -> str:
    """What differs, as a sentence; empty where nothing does. A line `…` stands for any number of lines."""
    want = [line.rstrip() for line in shown.strip("\n").split("\n")] if shown.strip() else []
    have = [line.rstrip() for line in obtained.strip("\n").split("\n")]
    if not want:
        return ""
    at, free = 0, False
    for line in want:
        if line.strip() == LEFT_OUT:
            free = True
            continue
        where = next((k for k in range(at, len(have)) if _same(line, have[k])), None) if free else (at if at < len(have) and _same(line, have[at]) else None)
        if where is None:
            return f"shown:    {line}\nobtained: " + (have[at] if at < len(have) else "nothing more") + "\nwhole output:\n" + "\n".join(have)
        at, free = where + 1, False
    if not free and at < len(have) and any(have[at:]):
        return f"not shown: {have[at]}\nwhole output:\n" + "\n".join(have)
    return ""


def _same(shown: str, obtained: str) -> bool:
    """Whether two lines agree; `…` in the line shown stands for any characters."""
    if LEFT_OUT not in shown:
        return _words(shown) == _words(obtained) and _numbers_agree(_numbers(shown), _numbers(obtained))
    pattern = ".*?".join(_pattern(part.strip()) for part in shown.split(LEFT_OUT))
    match = re.fullmatch(r"\s*" + pattern + r"\s*", obtained)
    if match is None:
        return False
    groups = match.groups()
    return _numbers_agree(_numbers(shown), [(digits.replace("−", "-"), power or "0") for digits, power in zip(groups[::2], groups[1::2])])


def _pattern(text: str) -> str:
    """A pattern for words and any numbers in their places, whatever the blanks between them."""
    pieces = NUMBER.split(text)
    words = [r"\s+".join(map(re.escape, re.split(r"\s+", piece))) for piece in pieces[::3]]
    return NUMBER.pattern.join(words)


def _words(line: str) -> list[str]:
    """What is left of a line without its numbers."""
    return NUMBER.sub("#", line).split()


def _numbers(line: str) -> list[tuple[str, str]]:
    return [(m[1].replace("−", "-"), m[2] or "0") for m in NUMBER.finditer(line)]


def _numbers_agree(shown: list[tuple[str, str]], obtained: list[tuple[str, str]]) -> bool:
    """Whether numbers agree to one unit of the last digit shown."""
    if len(shown) != len(obtained):
        return False
    for (digits, power), (other, other_power) in zip(shown, obtained):
        if (digits, power) == (other, other_power):
            continue
        if "." not in digits and power == "0":
            return False
        unit = 10.0 ** (int(power) - len(digits.partition(".")[2]))
        if abs(float(digits) * 10.0 ** int(power) - float(other) * 10.0 ** int(other_power)) > 1.01 * unit:
            return False
    return True
