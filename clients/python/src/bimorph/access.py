"""Credentials of a client, and the authorities that it trusts."""

from __future__ import annotations

import ipaddress
import os
from dataclasses import dataclass, field
from pathlib import Path

from .errors import InvalidRequest

_VARIABLES = {
    "ca": "BIMORPH_CA",
    "token_file": "BIMORPH_TOKEN_FILE",
    "client_cert": "BIMORPH_CLIENT_CERT",
    "client_key": "BIMORPH_CLIENT_KEY",
}
_SCHEMES = ("http://", "grpc://")
_SECURE = ("https://", "https:")


@dataclass(frozen=True)
class Access:
    """Credentials of a client, from keywords or from the environment: ``BIMORPH_CA``, ``BIMORPH_TOKEN_FILE``, ``BIMORPH_CLIENT_CERT``,
    ``BIMORPH_CLIENT_KEY``."""

    ca: str | None = None
    """Certificates (PEM) of the authorities to trust; needed for ``https://``."""
    token_file: str | None = None
    """File with the token: the last word of its first line that is not a comment."""
    client_cert: str | None = None
    """Certificate of the client (PEM), for servers that require one."""
    client_key: str | None = None
    """Key of that certificate (PEM)."""
    token: str | None = field(default=None, repr=False)
    """Token, in place of a file."""

    def with_environment(self) -> Access:
        """Credentials with missing ones taken from the environment."""
        given = {name: getattr(self, name) or os.environ.get(variable) or None for name, variable in _VARIABLES.items()}
        if self.token:
            given["token_file"] = None
        return Access(**given, token=self.token)

    def metadata(self, address: str) -> tuple[tuple[str, str], ...] | None:
        """Metadata of every call to a server; None on a Unix socket, which requires no token."""
        if not (self.token or self.token_file) or address.startswith("unix:"):
            return None
        if not is_secure(address) and not _is_here(target(address)):
            raise InvalidRequest(f"token: expected an address that begins with https://, got {address}; a token is not sent unencrypted to another machine")
        return (("authorization", f"Bearer {self.token or self._read()}"),)

    def _read(self) -> str:
        assert self.token_file is not None
        for line in _text("token_file", self.token_file).decode(errors="replace").splitlines():
            words = line.split()
            if words and not words[0].startswith("#"):
                return words[-1]
        raise InvalidRequest(f"token_file: expected a file with a token, got the empty file {self.token_file}")

    def certificates(self) -> tuple[bytes, bytes | None, bytes | None]:
        """Certificates of authorities, key and certificate of a TLS connection (PEM)."""
        if self.ca is None:
            raise InvalidRequest("ca: expected a file with the certificates of an authority to trust for https://, got none; give ca=FILE or set BIMORPH_CA")
        if (self.client_cert is None) != (self.client_key is None):
            raise InvalidRequest(f"{'client_key' if self.client_key is None else 'client_cert'}: expected a file, as the other one of client_cert and client_key is given, got none")
        key = None if self.client_key is None else _text("client_key", self.client_key)
        own = None if self.client_cert is None else _text("client_cert", self.client_cert)
        return _text("ca", self.ca), key, own


def is_secure(address: str) -> bool:
    """Whether an address requires TLS."""
    return address.startswith("https:")


def target(address: str) -> str:
    """Address in the form of gRPC."""
    for scheme in (*_SECURE, *_SCHEMES):
        address = address.removeprefix(scheme)
    return address.rstrip("/")


def _is_here(place: str) -> bool:
    host = place.rsplit(":", 1)[0].strip("[]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _text(what: str, path: str) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise InvalidRequest(f"{what}: expected a file that can be read, got {path}: {error.strerror}") from None
