"""Errors of the client, and how they come from gRPC statuses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import grpc
from google.rpc import error_details_pb2, status_pb2


class BimorphError(Exception):
    """Anything that went wrong, with the server's words."""


@dataclass(frozen=True)
class Violation:
    """A field of a request that cannot be used."""

    field: str
    """Path of the field, or ``file:line:column`` in a netlist."""
    description: str
    """What is wrong, and what was expected."""


@dataclass(frozen=True)
class Diagnostic:
    """A message about a place in a netlist."""

    code: str
    """Stable code such as ``E012``."""
    severity: str
    """``error`` or ``warning``."""
    file: str
    line: int
    """From 1."""
    column: int
    """From 1, in characters."""
    message: str
    help: str
    """A way out; may be empty."""


class InvalidRequest(BimorphError, ValueError):
    """An argument that cannot be used, as found here or by the server; the text begins with its name, and ``violations`` says which fields."""

    def __init__(self, message: str, violations: Sequence[Violation] = ()) -> None:
        super().__init__(message)
        self.violations = tuple(violations)

    def __reduce__(self) -> tuple[Any, ...]:
        # Errors of worker processes arrive as what they were.
        return (type(self), (str(self), self.violations))


class InvalidType(InvalidRequest, TypeError):
    """An argument of another type than expected."""


class UnknownColumn(InvalidRequest, KeyError):
    """A name that is no column of a table."""

    __str__ = BimorphError.__str__


class NetlistError(InvalidRequest):
    """A netlist with errors; its text is the rendered diagnostics."""

    def __init__(self, message: str, violations: Sequence[Violation], diagnostics: Sequence[Diagnostic]) -> None:
        super().__init__(message, violations)
        self.diagnostics = tuple(diagnostics)

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.violations, self.diagnostics))


class NotFound(BimorphError):
    """A model, session, sweep or state that the server does not have (any more)."""


class LimitExceeded(BimorphError):
    """A request beyond a limit of the server."""


class NoResult(BimorphError):
    """An analysis without a result: no equilibrium, nothing pulls in, a step that failed, a sweep whose points all failed."""

    def __init__(self, message: str, table: Any = None) -> None:
        super().__init__(message)
        self.table = table
        """Of a sweep whose points all failed, its :class:`Table`, with the reason of each; None otherwise."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.table))


class StepFailed(NoResult):
    """A device that cannot take a step, however short."""


class UnexpectedReply(BimorphError):
    """A reply that is none of those that were asked for: the server is faulty, of another version, or none of Bimorph."""


class Refused(BimorphError):
    """A server that asks for a token, or knows another one."""


class Unavailable(BimorphError):
    """No server, a server that stops, or no answer in time."""


_BY_CODE: dict[grpc.StatusCode, type[BimorphError]] = {
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.RESOURCE_EXHAUSTED: LimitExceeded,
    grpc.StatusCode.FAILED_PRECONDITION: NoResult,
    grpc.StatusCode.UNAUTHENTICATED: Refused,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
    grpc.StatusCode.DEADLINE_EXCEEDED: Unavailable,
}


def from_rpc(error: grpc.RpcError, address: str) -> BimorphError:
    """The error that a failed call stands for."""
    details = next((datum.value for datum in error.trailing_metadata() or () if datum.key == "grpc-status-details-bin"), b"")
    return _of_code(error.code(), error.details() or "", details, address)


def from_fault(number: int, text: str, address: str) -> BimorphError:
    """The error that a request stands for which a stream refused with this number of a gRPC code."""
    return from_status(number, text, b"", address)


def from_status(number: int, text: str, details: bytes, address: str) -> BimorphError:
    """The error that the number of a gRPC code stands for, with a message and ``google.rpc.Status`` as bytes."""
    code = next((code for code in grpc.StatusCode if code.value[0] == number), grpc.StatusCode.UNKNOWN)
    return _of_code(code, text, details, address)


_LONGEST = 65536
"""Longest text of a server that is shown [character]."""


def shown(text: str) -> str:
    """Text of a server: line breaks and tabs stay, other characters that control a terminal are written out, and what is very long is cut."""
    text = text if len(text) <= _LONGEST else text[:_LONGEST] + " …"
    if text.isprintable():
        return text
    return "".join(c if c in "\n\t" or c.isprintable() else repr(c)[1:-1] for c in text)


_FAILURES: list[tuple[str, str]] = [
    (
        r"failed to connect to all addresses|connect failed|connection refused|no such file or directory|failed to connect to remote host",
        "no server answers at this address{cause}; start one there, or check the address",
    ),
    (r"errors? resolving|domain name not found|name or service not known|\bdns\b", "the name of the host is unknown; check the address"),
    (
        r"stream removed|socket closed|connection broke|h2 protocol|connection reset|broken pipe|goaway|ping timeout|keepalive|end of file",
        "the connection is lost, as the server has ended or the network has failed; connect again when the server runs (a kept session: resume())",
    ),
    (r"deadline exceeded", "no answer within the timeout of the call; give a longer timeout, or check the server"),
    (r"shutting down", "the server is shutting down; connect again when it runs (a kept session: resume())"),
]
"""What a failure of the network says, in words of gRPC or of the system, and the sentence for it."""
_CAUSE = re.compile(r"ssl[^;:]*handshake[^;:]*|certificate[^;:]*|connection refused|no such file or directory|permission denied|no route to host|timed out", re.IGNORECASE)


def _failure(text: str) -> str:
    """A failure of the network in one sentence: what has happened, and the remedy. Other texts are as they are."""
    for pattern, sentence in _FAILURES:
        if re.search(pattern, text, re.IGNORECASE):
            cause = _CAUSE.search(text)
            return sentence.format(cause=f" ({cause[0].strip().lower()})" if cause else "")
    return text


def _of_code(code: grpc.StatusCode, text: str, details: bytes, address: str) -> BimorphError:
    text = shown(text)
    if code == grpc.StatusCode.INVALID_ARGUMENT:
        return InvalidRequest(text, violations(details))
    kind = _BY_CODE.get(code, BimorphError)
    if kind is Unavailable:
        text = f"server {address}: {_failure(text)}"
    elif kind is BimorphError:
        text = f"{code.name.lower()}: {text}"
    return kind(text)


def violations(details: bytes) -> list[Violation]:
    """The field violations in a ``google.rpc.Status``."""
    found = []
    for detail in status_pb2.Status.FromString(details).details:
        bad = error_details_pb2.BadRequest()
        if detail.Unpack(bad):
            found += [Violation(shown(v.field), shown(v.description)) for v in bad.field_violations]
    return found
