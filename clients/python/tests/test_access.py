"""A server that requires TLS and a token: a client with both is served, and the error of another names what is missing."""

from __future__ import annotations

import pickle
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import PLATE, ROOT

import bimorph

KEYS = ROOT / "tests" / "tls"
TOKEN = "0123456789abcdef0123456789abcdef"


def guarded(program: str, folder: Path, *more: str) -> subprocess.Popen[str]:
    """A server at a free port with a token."""
    tokens = folder / "tokens"
    tokens.write_text(f"python {TOKEN}\n")
    tokens.chmod(0o600)
    words = [program, "serve", "--listen", "127.0.0.1:0", "--while-stdin", "--token-file", str(tokens), *more]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def address(process: subprocess.Popen[str]) -> str:
    """Where it listens."""
    assert process.stderr is not None
    return next(line for line in process.stderr if line.startswith("listening on")).split()[-1]


@pytest.fixture(scope="module")
def secure(program: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server with TLS that requires certificates and tokens."""
    words = ["--tls-cert", "server.pem", "--tls-key", "server.key", "--tls-client-ca", "authority.pem"]
    words = [str(KEYS / word) if "." in word else word for word in words]
    with guarded(program, tmp_path_factory.mktemp("keys"), *words) as process:
        yield address(process)
        process.terminate()


OWN = {"client_cert": KEYS / "client.pem", "client_key": KEYS / "client.key"}


def test_who_shows_everything_is_served(secure: str, tmp_path: Path) -> None:
    """Unary calls, streams and sessions, also of a client that was pickled; the token from a file."""
    assert secure.startswith("https://")
    file = tmp_path / "token"
    file.write_text(f"# mine\n{TOKEN}\n")
    client = bimorph.Client(secure, ca=KEYS / "authority.pem", token_file=file, **OWN)
    model = pickle.loads(pickle.dumps(client)).compile(bimorph.Netlist.text(PLATE))
    with model.session() as session:
        assert session.operating_point({"drive": 1.0}).token
    assert model.transient(1e-6, ["m.x"], points=3).t[-1] == 1e-6


def test_the_environment_says_the_same(secure: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The four variables are those of the command and the plug-in."""
    file = tmp_path / "token"
    file.write_text(TOKEN)
    monkeypatch.setenv("BIMORPH_CA", str(KEYS / "authority.pem"))
    monkeypatch.setenv("BIMORPH_TOKEN_FILE", str(file))
    monkeypatch.setenv("BIMORPH_CLIENT_CERT", str(KEYS / "client.pem"))
    monkeypatch.setenv("BIMORPH_CLIENT_KEY", str(KEYS / "client.key"))
    assert bimorph.Client(secure).version() == bimorph.Client(secure).version()


@pytest.mark.parametrize("token, said", [(None, "requires a token"), ("x" * 32, "none of this server's")])
def test_tokens_that_are_missing_or_wrong(secure: str, token: str | None, said: str) -> None:
    """Refused, with what to do."""
    client = bimorph.Client(secure, ca=KEYS / "authority.pem", token=token, **OWN)
    with pytest.raises(bimorph.Refused, match=said):
        client.version()


@pytest.mark.parametrize("name", [None, "client-expired", "client-stranger"])
def test_certificates_that_are_missing_or_wrong(secure: str, name: str | None) -> None:
    """The handshake fails, whatever token there is."""
    own = {} if name is None else {"client_cert": KEYS / f"{name}.pem", "client_key": KEYS / f"{name}.key"}
    client = bimorph.Client(secure, 10.0, ca=KEYS / "authority.pem", token=TOKEN, **own)
    with pytest.raises(bimorph.Unavailable):
        client.version()


def test_a_server_of_another_authority(secure: str) -> None:
    """A server that the client does not trust gets no token."""
    client = bimorph.Client(secure, 10.0, ca=KEYS / "stranger.pem", token=TOKEN, **OWN)
    with pytest.raises(bimorph.Unavailable):
        client.version()


def test_plaintext(secure: str) -> None:
    """Plain HTTP/2 at an address of TLS gets an error that says so."""
    with pytest.raises(bimorph.Refused, match="https://"):
        bimorph.Client(secure.removeprefix("https://"), token=TOKEN).version()


def test_a_token_stays_private() -> None:
    """It is not sent unencrypted to another machine, and not shown."""
    with pytest.raises(bimorph.InvalidRequest, match="unencrypted"):
        bimorph.Client("192.0.2.1:50051", token=TOKEN).version()
    with pytest.raises(bimorph.InvalidRequest, match="BIMORPH_CA"):
        bimorph.Client("https://192.0.2.1:50051", token=TOKEN).version()


def test_tokens_without_tls(program: str, tmp_path: Path) -> None:
    """On this machine a token is required, and enough, without TLS."""
    with guarded(program, tmp_path) as process:
        here = address(process)
        assert not here.startswith("https")
        with pytest.raises(bimorph.Refused):
            bimorph.Client(here).version()
        assert bimorph.Client(here, token=TOKEN).version()
        process.terminate()
