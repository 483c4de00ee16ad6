"""Requests of other pages and of programs without the token are refused, and a flood of requests leaves the bench alive."""

from __future__ import annotations

import http.client
import http.server
import json
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

from conftest import ROOT

ASK = json.dumps({"channel": "static", "state": {}, "ask": {"kind": "static"}})
TYPE = {"content-type": "application/json"}


def request(page: Any, method: str, path: str, body: str | bytes | None = None, headers: dict[str, str] | None = None) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection(page.host, page.port, timeout=30)
    try:
        connection.request(method, path, body, headers or {})
        response = connection.getresponse()
        return response.status, response.read()
    finally:
        connection.close()


def test_requests_without_the_token(bench: Any) -> None:
    """No path without the token is served, whatever its method; the page of the token is."""
    page = bench("examples/switch/switch.net")
    token = urlparse(page.url).path
    assert request(page, "GET", token)[0] == 200
    for path in ("/", "/ask", "/" + "0" * 32 + "/", token[:-2] + "/", "//" + token, token.upper().replace("A", "B", 1) + "x"):
        assert request(page, "GET", path)[0] in (403, 404), path
    assert request(page, "POST", "/ask", ASK, TYPE)[0] == 403
    assert request(page, "POST", token + "ask", ASK, TYPE)[0] == 200
    assert request(page, "GET", token + "ask")[0] == 405
    assert request(page, "GET", token + "../../etc/passwd")[0] == 404
    assert request(page, "POST", token + "ask", ASK)[0] == 415


def test_other_origins_and_hosts(bench: Any) -> None:
    """A request of another origin, for another host (DNS rebinding) or from another site is refused, even with the token."""
    page = bench("examples/switch/switch.net")
    ask, own = urlparse(page.url).path + "ask", f"{page.host}:{page.port}"
    wrong = (
        {"Host": f"evil.example:{page.port}"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": f"https://{own}"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    )
    for headers in wrong:
        assert request(page, "POST", ask, ASK, {**TYPE, **headers})[0] == 403, headers
    assert request(page, "POST", ask, ASK, {**TYPE, "Origin": f"http://{own}", "Sec-Fetch-Site": "same-origin"})[0] == 200
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "document"}
    assert request(page, "GET", urlparse(page.url).path, None, link)[0] == 200, "a link in a terminal of the browser leads here"
    assert request(page, "POST", ask, ASK, {**TYPE, **link})[0] == 403
    assert request(page, "GET", urlparse(page.url).path, None, {**link, "Sec-Fetch-Dest": "iframe"})[0] == 403
    with socket.create_connection((page.host, page.port)) as raw:
        raw.sendall(f"GET {urlparse(page.url).path} HTTP/1.1\r\nHost: {own}\r\nHost: evil.example\r\n\r\n".encode())
        assert b" 400 " in raw.recv(100)


def test_replies_carry_their_policy(bench: Any) -> None:
    """Every reply forbids foreign scripts, frames and caches."""
    page = bench("examples/switch/switch.net")
    connection = http.client.HTTPConnection(page.host, page.port)
    connection.request("GET", urlparse(page.url).path)
    headers = connection.getresponse().headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy and "unsafe" not in policy
    assert headers["cache-control"] == "no-store" and headers["referrer-policy"] == "no-referrer"
    assert headers.get("access-control-allow-origin") is None


def test_a_page_of_another_origin(bench: Any, browser: Any, tmp_path: Path) -> None:
    """A page of another origin in the same browser reads no answer and shows no bench in a frame, even if it knows the address."""
    page = bench("examples/switch/switch.net")
    (tmp_path / "evil.html").write_text("<!doctype html><title>evil</title><body></body>")
    handler = type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), lambda *a: handler(*a, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        browser.get(f"http://127.0.0.1:{server.server_port}/evil.html")
        script = """
            const [url, body, done] = arguments, tried = [];
            const attempt = (name, options) => fetch(url + name, options).then(r => r.text()).then(() => 'read', () => 'refused');
            Promise.all([
              attempt('', {}), attempt('ask', {method: 'POST', body, headers: {'content-type': 'application/json'}}),
              attempt('ask', {method: 'POST', body, headers: {'content-type': 'text/plain'}}),
              fetch(url + 'bench.js', {mode: 'no-cors'}).then(() => 'opaque', () => 'refused'),
            ]).then(done)
        """
        found = browser.execute_async_script(script, page.url, ASK)
        assert found[:3] == ["refused"] * 3, found
        assert found[3] in ("refused", "opaque")
        browser.execute_script("const f = document.createElement('iframe'); f.src = arguments[0]; document.body.append(f)", page.url)
        time.sleep(0.5)
        frames = browser.execute_script("try { return Boolean(document.querySelector('iframe').contentDocument?.getElementById('bench')) } catch { return false }")
        assert not frames
    finally:
        server.shutdown()
        browser.get("about:blank")
        browser.get_log("browser")


def test_oversized_and_malformed_requests(bench: Any) -> None:
    """Bodies beyond the limit, wrong JSON and unknown requests are refused, and the bench stays alive."""
    page = bench("examples/switch/switch.net")
    ask = urlparse(page.url).path + "ask"
    declared = {**TYPE, "content-length": str(1 << 40)}
    assert request(page, "POST", ask, b"x", declared)[0] == 413
    long = json.dumps({"state": {"text": "x" * (3 << 20)}, "ask": {"kind": "static"}})
    try:
        assert request(page, "POST", ask, long, TYPE)[0] == 413
    except (ConnectionError, http.client.HTTPException):
        pass  # closed while the rest was on its way
    for body in (b"", b"{", b"[]", b"\xff\xfe", b'{"ask":{"kind":"nothing"}}', b'{"ask":{"kind":"static","more":1}}', b"[" * 100_000):
        assert request(page, "POST", ask, body, TYPE)[0] == 400, body[:40]
    for state in ({"ports": {"drive": 1e300}}, {"ports": {"no": 1}}, {"set": {"no": 1}}, {"set": {"touch": "text"}}, {"text": "beam"}):
        status, text = request(page, "POST", ask, json.dumps({"state": state, "ask": {"kind": "static"}}), TYPE)
        assert status == 422 and json.loads(text)["error"], state
    for many in ({"kind": "yield", "vary": ["touch=normal:1:1"], "samples": 10**9, "seed": 1, "analysis": "static"}, {"kind": "transient", "stop": 1, "points": 10**9}, {"kind": "modes", "count": 10**9, "shapes": True}):
        assert request(page, "POST", ask, json.dumps({"ask": many}), TYPE)[0] == 422, many
    assert request(page, "POST", ask, ASK, TYPE)[0] == 200


def test_a_thousand_requests_a_second(bench: Any) -> None:
    """Of a flood of requests each is answered or superseded, and the bench answers at once afterwards."""
    page = bench("examples/rotary_stage/rotary_stage.net")
    ask = urlparse(page.url).path + "ask"
    statuses: list[int] = []

    def flood(k: int) -> None:
        connection = http.client.HTTPConnection(page.host, page.port, timeout=60)
        for j in range(125):
            state = {"ports": {"clockwise": 0.001 * (j + k)}}
            connection.request("POST", ask, json.dumps({"channel": "static", "state": state, "ask": {"kind": "static"}}), TYPE)
            response = connection.getresponse()
            response.read()
            statuses.append(response.status)
        connection.close()

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(flood, range(8)))
    assert len(statuses) == 1000 and set(statuses) <= {200, 409}, set(statuses)
    assert statuses.count(200) >= 1
    assert request(page, "POST", ask, ASK, TYPE)[0] == 200


def test_many_connections(bench: Any) -> None:
    """Connections that send nothing make room for new ones."""
    page = bench("examples/switch/switch.net")
    idle = [socket.create_connection((page.host, page.port)) for _ in range(300)]
    try:
        assert request(page, "POST", urlparse(page.url).path + "ask", ASK, TYPE)[0] == 200
    finally:
        for one in idle:
            one.close()


def test_a_lost_request_stops(bench: Any) -> None:
    """The computation of a request whose connection is closed ends at once: the processor rests."""
    from conftest import processor_time

    page = bench("examples/bank/bank.net")
    ask = {"kind": "transient", "stop": 1.0, "points": 1000, "signals": ["yoke.y"], "waves": {"heat": [[0, 0], [1e-4, 3]]}}
    body = json.dumps({"channel": "transient", "ask": ask}).encode()
    with socket.create_connection((page.host, page.port)) as raw:
        head = f"POST {urlparse(page.url).path}ask HTTP/1.1\r\nHost: {page.host}:{page.port}\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        raw.sendall(head.encode() + body)
        time.sleep(1.0)
    time.sleep(0.7)
    before = processor_time(page.process.pid)
    time.sleep(0.7)
    assert processor_time(page.process.pid) - before <= 0.05


def test_only_loopback(bench: Any) -> None:
    """The bench listens at 127.0.0.1 alone."""
    page = bench("examples/switch/switch.net")
    lines = Path("/proc/net/tcp").read_text().split("\n")[1:]
    listening = [line.split() for line in lines if line.split()[3:4] == ["0A"]]
    own = [fields[1] for fields in listening if int(fields[1].split(":")[1], 16) == page.port]
    assert own == [f"0100007F:{page.port:04X}"]
    assert str(page.port) not in {str(int(line.split()[1].split(":")[1], 16)) for line in Path("/proc/net/tcp6").read_text().split("\n")[1:] if line.split()[3:4] == ["0A"]}
    assert ROOT.is_dir()
