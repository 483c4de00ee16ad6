"""Errors of the client, and their conversion from gRPC statuses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import grpc
from google.rpc import error_details_pb2, status_pb2


class BimorphError(Exception):
    """Base class of all errors of this package."""


@dataclass(frozen=True)
class Violation:
    """An invalid field of a request."""

    field: str
    """Path of the field, or ``file:line:column`` in a netlist."""
    description: str
    """The error, and the expected value."""


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
    """Remedy; may be empty."""


class InvalidRequest(BimorphError, ValueError):
    """An invalid argument, detected by the client or by the server. The text begins with the name of the argument; ``violations`` has the fields."""

    def __init__(self, message: str, violations: Sequence[Violation] = ()) -> None:
        super().__init__(message)
        self.violations = tuple(violations)

    def __reduce__(self) -> tuple[Any, ...]:
        # Errors of worker processes keep their class.
        return (type(self), (str(self), self.violations))


class InvalidType(InvalidRequest, TypeError):
    """An argument of another type than expected."""


class UnknownColumn(InvalidRequest, KeyError):
    """A name that is not a column of a table."""

    __str__ = BimorphError.__str__


class NetlistError(InvalidRequest):
    """A netlist with errors. Its text is the rendered diagnostics."""

    def __init__(self, message: str, violations: Sequence[Violation], diagnostics: Sequence[Diagnostic]) -> None:
        super().__init__(message, violations)
        self.diagnostics = tuple(diagnostics)

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.violations, self.diagnostics))


class NotFound(BimorphError):
    """A model, session, sweep or state that the server does not have, or has released."""


class LimitExceeded(BimorphError):
    """A request that exceeds a limit of the server."""


class NoResult(BimorphError):
    """An analysis without a result: no equilibrium, no pull-in, a failed step, or a sweep with no successful point."""

    def __init__(self, message: str, table: Any = None) -> None:
        super().__init__(message)
        self.table = table
        """For a sweep with no successful point its :class:`Table`, with the reason of each point; otherwise None."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.table))


class StepFailed(NoResult):
    """A step that the device cannot take at any length."""


class UnexpectedReply(BimorphError):
    """A reply that violates the protocol: the server is faulty, of another version, or not a Bimorph server."""


class Refused(BimorphError):
    """Rejected credentials: the server requires a token, or another one."""


class Unavailable(BimorphError):
    """No server at the address, a lost connection, or no reply within a timeout."""


_BY_CODE: dict[grpc.StatusCode, type[BimorphError]] = {
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.RESOURCE_EXHAUSTED: LimitExceeded,
    grpc.StatusCode.FAILED_PRECONDITION: NoResult,
    grpc.StatusCode.UNAUTHENTICATED: Refused,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
    grpc.StatusCode.DEADLINE_EXCEEDED: Unavailable,
}


def from_rpc(error: grpc.RpcError, address: str) -> BimorphError:
    """Error for a failed call."""
    details = next((datum.value for datum in error.trailing_metadata() or () if datum.key == "grpc-status-details-bin"), b"")
    return _of_code(error.code(), error.details() or "", details, address)


def from_fault(number: int, text: str, address: str) -> BimorphError:
    """Error for a request that a stream rejected with this gRPC status code."""
    return from_status(number, text, b"", address)


def from_status(number: int, text: str, details: bytes, address: str) -> BimorphError:
    """Error for a gRPC status code, with a message and a serialised ``google.rpc.Status``."""
    code = next((code for code in grpc.StatusCode if code.value[0] == number), grpc.StatusCode.UNKNOWN)
    return _of_code(code, text, details, address)


_LONGEST = 65536
"""Longest text of a server that is shown [characters]."""


def shown(text: str) -> str:
    """Text of a server, safe for a terminal. Line breaks and tabs stay, other control characters are escaped, and a very long text is cut."""
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
"""Patterns of network failures in texts of gRPC and the system, and the sentence for each."""
_CAUSE = re.compile(r"ssl[^;:]*handshake[^;:]*|certificate[^;:]*|connection refused|no such file or directory|permission denied|no route to host|timed out", re.IGNORECASE)


def _failure(text: str) -> str:
    """One sentence with failure and remedy for a failure of the network; other texts are returned unchanged."""
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
