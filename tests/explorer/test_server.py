"""The server, asked as a page asks it and as nobody should: everything over real sockets."""

import contextlib
import json
import os
import signal
import socket
import time
from urllib.parse import quote

import pytest
from explorer_fuzz import messages
from explorer_server import PAGE, Explorer, unpacked
from libraries import thinned
from websockets.exceptions import ConnectionClosed, InvalidStatus

import gonio as gn

UP = [[0.0, 0.0, 1.0]]


def test_the_page_and_its_files(explorer):
    for name, text in {"": PAGE["index.html"], **PAGE}.items():
        status, headers, content = explorer.get(name)
        assert (status, content.decode()) == (200, text)
    assert headers["content-type"] == "text/plain; charset=utf-8"


def test_every_answer_keeps_to_itself(explorer):
    for status, headers, _ in (
        explorer.get(""),
        explorer.get("nothing"),
        explorer.raw("/"),
        explorer.get("", Host="x"),
    ):
        policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
        assert policy["default-src"] == policy["frame-ancestors"] == "'none'", status
        assert policy["script-src"] == "'self'"
        assert policy["connect-src"] == f"'self' ws://{explorer.host}"
        assert headers["x-content-type-options"] == "nosniff" and headers["cache-control"] == "no-store"
        assert headers["referrer-policy"] == "no-referrer" and headers["x-frame-options"] == "DENY"
        assert "access-control-allow-origin" not in headers and "server" not in headers


def test_without_the_token_there_is_nothing(explorer):
    wrong = ["/", "/explorer.js", "/socket", f"/{explorer.token[:-1]}/", f"/{explorer.token}x/", f"/{explorer.token}"]
    wrong += [f"//{explorer.token}/", "/" + "%00" * 20 + "/", f"/{quote('é')}/", "/open/", "/open/x"]
    for path in wrong:
        assert explorer.raw(path)[0] == 404, path
        assert explorer.raw(path, "POST", b"x")[0] == 404, path


@pytest.mark.parametrize(
    "host", ["example.com", "127.0.0.1", "127.0.0.1:1", "localhost.example.com:{port}", "[::1]:{port}"]
)
def test_other_hosts_are_refused(explorer, host):
    assert explorer.get("", Host=host.format(port=explorer.port))[0] == 403


def test_both_names_of_the_host(explorer):
    assert explorer.get("", Host=f"localhost:{explorer.port}")[0] == 200


@pytest.mark.parametrize(
    "origin", ["http://example.com", "null", "https://127.0.0.1:{port}", "http://127.0.0.1", "file://"]
)
def test_other_origins_are_refused(explorer, origin):
    origin = origin.format(port=explorer.port)
    assert explorer.get("", Origin=origin)[0] == 403
    assert explorer.raw(f"/{explorer.token}/upload?name=a", "POST", b"x", Origin=origin)[0] == 403
    with pytest.raises(InvalidStatus) as refused, explorer.socket(origin=origin):
        pass
    assert refused.value.response.status_code == 403


def test_a_socket_needs_the_token(explorer):
    from websockets.sync.client import connect

    for path in ("socket", "x/socket", f"{explorer.token}x/socket", f"{explorer.token}/other"):
        with pytest.raises(InvalidStatus), connect(f"ws://{explorer.host}/{path}"):
            pass


TRAVERSALS = (
    *("../../../../etc/passwd", "..%2f..%2f..%2fetc%2fpasswd", "%2e%2e/%2e%2e/etc/passwd", "./../explorer.js"),
    *("..\\..\\windows\\win.ini", "..%5c..%5cwin.ini", "%00", "explorer.js%00.txt", "//etc/passwd", "explorer.js/"),
    *("%252e%252e%252fetc%252fpasswd", "..;/etc/passwd", "....//etc/passwd", "static/index.html", "__init__.py"),
)


@pytest.mark.parametrize("path", TRAVERSALS)
def test_no_path_leads_elsewhere(explorer, path):
    for head in (f"/{explorer.token}/", "/", f"/{explorer.token}/../{explorer.token}/"):
        text = f"GET {head}{path} HTTP/1.1\r\nHost: {explorer.host}\r\nConnection: close\r\n\r\n".encode()
        status = explorer.bytes(text).partition(b"\r\n")[0]
        assert status.split()[1:2] in ([b"404"], [b"400"]), (path, status)


@pytest.mark.parametrize(
    "content",
    [
        b"\0" * 100,
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET http://example.com/ HTTP/1.1\r\nHost: example.com\r\nConnection: close\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\nConnection: close\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 50_000 + b"\r\n",
        b"GET /" + b"a" * 200_000 + b" HTTP/1.1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: -5\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    ],
)
def test_what_is_no_request(explorer, content):
    try:
        answer = explorer.bytes(content)
    except OSError:  # the server has hung up
        answer = b""
    assert not answer or answer.split()[1] in (b"400", b"403", b"404", b"431")
    assert explorer.get("")[0] == 200


def test_methods(explorer):
    for method in ("PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "POST"):
        assert explorer.get("", method)[0] == 405
    assert explorer.get("upload")[0] in (404, 405)


def test_calls(explorer):
    names = explorer.result("names")
    assert names["given"] == [{"text": "gold", "title": "gold"}] and names["version"] == gn.__version__
    found = explorer.result("material", text="gold", replaced={"alpha": 0.3})
    assert next(p["value"] for p in found["parameters"] if p["path"] == "distribution.alpha_x") == 0.3
    text = explorer.result("source", text="gold", language="c", function=["f", "pdf"])["text"]
    assert "_pdf" in text
    wi = [[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]]
    values = explorer.result("f", text="gold", wi=wi, wo=UP * 2)["values"]
    assert values == pytest.approx(gn.material("gold").f(wi, UP * 2), rel=1e-6)
    assert explorer.result("data", text="gold", theta_i=30)["csv"].startswith("# gold")
    assert all(row["verdict"] == "pass" for row in explorer.result("check", text="Lambertian(0.3)")["rows"])
    assert explorer.result("albedo", text="Lambertian(0.3)")["values"].shape[1] == 1


def test_errors_have_the_words_of_the_command_line(explorer):
    found = explorer.ask("material", text="Lambertian(1.2)")
    assert not found["ok"] and found["error"].startswith("Lambertian(rho=1.2): 1.2 is out of bounds;")
    assert "no built-in material" in explorer.ask("material", text="/etc/passwd")["error"]
    assert "may open none" in explorer.ask("material", text="load('/etc/passwd')")["error"]
    found = explorer.ask("f", text="gold", wi=UP, wo=UP * 2)
    assert not found["ok"] and "1 wi and 2 wo" in found["error"]


MALFORMED = (
    *(b"", b"\0\1\2", "", "{", "null", "[]", '"f"', "5", "[" * 100_000, '{"a":' * 50_000, '{"id": NaN}'),
    *('{"id": 7, "call": 5}', '{"id": 7, "call": "__init__"}', '{"id": 7, "call": "material"}', '{"id": 7}'),
    *('{"id": [1], "call": "names2"}', '{"id": 1e999, "call": ""}', '{"id": 7, "call": "f", "text": "gold", "wi": 1}'),
    '{"id": 7, "call": "material", "text": "gold", "replaced": {"alpha": 1e999}}',
)


def test_malformed_messages_are_answered(explorer):
    with explorer.socket() as connection:
        for message in MALFORMED:
            connection.send(message)
            found = unpacked(connection.recv(timeout=60))
            assert not found["ok"] and found["error"], message
            assert found["id"] == (7 if isinstance(message, str) and '"id": 7' in message else None)
        connection.send('{"id": 8, "call": "names"}')
        assert unpacked(connection.recv(timeout=60))["ok"]


def test_a_message_that_is_too_long_ends_its_socket_alone(explorer):
    with explorer.socket() as connection, pytest.raises(ConnectionClosed):
        connection.send("x" * (1 << 22) + "x")
        connection.recv(timeout=60)
    assert explorer.ask("names")["ok"]


def test_many_requests_at_once(explorer):
    with explorer.socket() as connection:
        for number in range(100):
            connection.send(json.dumps({"id": number, "call": "f", "text": "gold", "wi": UP, "wo": UP}))
        answers = [unpacked(connection.recv(timeout=120)) for _ in range(100)]
    assert sorted(a["id"] for a in answers) == list(range(100)) and all(a["ok"] for a in answers)


def test_a_page_that_goes_away(explorer):
    for _ in range(20):
        with explorer.socket() as connection:
            connection.send(json.dumps({"id": 1, "call": "material", "text": "gold"}))
    assert explorer.ask("names")["ok"]


@pytest.mark.parametrize("count", [100, pytest.param(10_000, marks=pytest.mark.full)])
def test_messages_of_any_kind(explorer, count):
    with explorer.socket() as connection:
        for message in messages(count, seed=1):
            connection.send(message)
            found = unpacked(connection.recv(timeout=120))
            assert found["ok"] is True or (found["error"] and "fault of gonio" not in found["error"]), message
    assert explorer.process.poll() is None


def test_a_dropped_file(explorer, tmp_path):
    gn.save(gn.Lambertian([0.6, 0.1, 0.05]), tmp_path / "red.json")
    status, answer = explorer.upload("some/where/my red.json", (tmp_path / "red.json").read_bytes())
    assert status == 200 and answer["text"].endswith("/my_red.json")
    found = explorer.result("material", text=answer["text"])
    assert found["channels"] == 3 and found["upload"]
    assert "gn.load('my_red.json')" in found["snippet"]


def test_a_bad_file(explorer):
    _, answer = explorer.upload("bad.binary", os.urandom(5000))
    found = explorer.ask("material", text=answer["text"])
    assert not found["ok"] and "bad.binary" in found["error"]


@pytest.mark.parametrize(
    "name", ["", "..", "../../x", "a\0b", "/etc/passwd", "CON", "x" * 5000 + ".nc", ".bashrc", "é.nc"]
)
def test_names_of_dropped_files(explorer, name):
    status, answer = explorer.upload(name, b"x")
    number, _, kept = answer["text"].removeprefix("upload:").partition("/")
    assert status == 200 and number.isdigit() and "/" not in kept and not kept.startswith(".") and len(kept) <= 100
    assert not name.endswith(".nc") or kept.endswith(".nc")


def test_a_file_that_says_it_is_too_large(explorer):
    head = f"POST /{explorer.token}/upload?name=a HTTP/1.1\r\nHost: {explorer.host}\r\nConnection: close\r\n"
    answer = explorer.bytes(f"{head}Content-Length: 256000001\r\n\r\n".encode())
    assert answer.startswith(b"HTTP/1.1 413") and b"expected at most 256 MB" in answer
    assert explorer.ask("names")["ok"]


@pytest.mark.parametrize("call", ["crash", "hang", "exhaust"])
def test_a_worker_that_fails_is_followed_by_another(explorer, call):
    _, answer = explorer.upload("a.json", json.dumps(gn.Lambertian(0.3).to_json()).encode())
    found = explorer.ask(call)
    assert not found["ok"]
    words = {"crash": "has crashed (exit code 3)", "hang": "took more than 1 s", "exhaust": "not enough memory"}[call]
    assert words in found["error"]
    assert explorer.result("material", text=answer["text"])["class"] == "Lambertian"
    assert explorer.result("material", text="gold")["title"] == "gold"


def test_a_worker_that_is_killed(explorer):
    assert explorer.ask("names")["ok"]
    workers = explorer.children()
    with explorer.socket() as connection:
        connection.send('{"id": 1, "call": "slow"}')
        connection.send('{"id": 2, "call": "names"}')
        assert unpacked(connection.recv(timeout=60))["id"] == 2  # what was sent before it has reached the worker
        for worker in workers:
            os.kill(worker, signal.SIGKILL)
        found = unpacked(connection.recv(timeout=60))
        assert not found["ok"] and "SIGKILL" in found["error"]
        connection.send('{"id": 3, "call": "names"}')
        assert unpacked(connection.recv(timeout=60))["ok"]
    assert {*workers}.isdisjoint(explorer.children())


def test_a_time_out_in_one_tab_ends_no_call_of_another(explorer):
    with explorer.socket() as a, explorer.socket() as b:
        a.send('{"id": 1, "call": "hang"}')
        b.send('{"id": 1, "call": "slow"}')
        b.send('{"id": 2, "call": "f", "text": "gold", "wi": [[0, 0, 1]], "wo": [[0, 0, 1]]}')
        assert unpacked(b.recv(timeout=60))["id"] == 2
        assert "took more than 1 s" in unpacked(a.recv(timeout=60))["error"]
        assert unpacked(b.recv(timeout=60))["ok"]


def ends_within(connection, seconds):
    """Whether the server hangs up."""
    connection.settimeout(seconds)
    try:
        while connection.recv(1 << 16):
            pass
    except TimeoutError:
        return False
    except OSError:
        pass
    return True


def test_connections_that_say_nothing_take_no_places(explorer):
    """Seventy, some with half a request, a wrong token, or asking for a socket without it; then they are closed."""
    said = [b"", b"GET / HTTP/1.1\r\nHost: a", f"GET /{explorer.token}/ HTTP/1.1\r\nHost:".encode()]
    said += [f"POST /x/ HTTP/1.1\r\nHost: {explorer.host}\r\nContent-Length: 100\r\n\r\n".encode()]
    key = (
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
        + "A" * 22
        + "=="
    )
    said += [f"GET /x/socket HTTP/1.1\r\nHost: {explorer.host}\r\n{key}\r\n\r\n".encode()]
    with explorer.socket() as tab, contextlib.ExitStack() as stack:
        silent = []
        for k in range(70):
            silent.append(stack.enter_context(socket.create_connection(("127.0.0.1", explorer.port))))
            silent[-1].sendall(said[k % len(said)])
        for _ in range(3):
            assert explorer.get("")[0] == 200
            assert explorer.ask("names")["ok"]
        assert explorer.upload("a.json", b"{}")[0] == 200
        tab.send('{"id": 1, "call": "f", "text": "gold", "wi": [[0, 0, 1]], "wo": [[0, 0, 1]]}')
        assert unpacked(tab.recv(timeout=60))["ok"]
        assert all(ends_within(each, 5.0) for each in silent)


def test_a_request_is_there_soon_or_its_connection_is_closed(explorer):
    """Of who has shown the token: a second request that stops within its head, a file that stops; not a slow one."""
    get = f"GET /{explorer.token}/ HTTP/1.1\r\nHost: {explorer.host}\r\n"
    upload = f"POST /{explorer.token}/upload?name=a HTTP/1.1\r\nHost: {explorer.host}\r\nContent-Length: 8\r\n\r\n"
    with contextlib.ExitStack() as stack:
        head, body, slow = (
            stack.enter_context(socket.create_connection(("127.0.0.1", explorer.port))) for _ in range(3)
        )
        head.sendall(f"{get}\r\n{get}".encode())
        body.sendall(f"{upload}1234".encode())
        slow.sendall(upload.encode())
        for _ in range(8):
            time.sleep(0.4)
            slow.sendall(b"1")
            with contextlib.suppress(OSError):
                head.sendall(b"a: b\r\n")  # does not help
        assert ends_within(head, 2.0) and ends_within(body, 2.0)
        slow.settimeout(5.0)
        assert slow.recv(1 << 16).startswith(b"HTTP/1.1 200")


def test_calls_do_not_wait_for_others(explorer):
    with explorer.socket() as connection:
        connection.send('{"id": 1, "call": "hang"}')
        connection.send('{"id": 2, "call": "f", "text": "gold", "wi": [[0, 0, 1]], "wo": [[0, 0, 1]]}')
        assert unpacked(connection.recv(timeout=60))["id"] == 2
        assert not unpacked(connection.recv(timeout=60))["ok"]


@pytest.mark.parametrize(
    "number",
    thinned([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], [signal.SIGINT, signal.SIGTERM]),
    ids=lambda number: number.name,
)
def test_signals_end_everything(number, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with Explorer("gold") as explorer, explorer.socket() as connection:
        connection.send('{"id": 1, "call": "names"}')
        connection.recv(timeout=60)
        assert len(list(tmp_path.glob("gonio-view-*"))) == 1
        (worker,) = explorer.children()
        code, errors = explorer.stop(number)
    assert code == {signal.SIGINT: 0, signal.SIGTERM: 143, signal.SIGHUP: 0}[number]
    assert errors == ""
    assert not list(tmp_path.glob("gonio-view-*"))
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)


def test_a_killed_server_leaves_no_worker():
    with Explorer() as explorer:
        assert explorer.ask("names")["ok"]
        (worker,) = explorer.children()
        explorer.stop(signal.SIGKILL)
    for _ in range(100):
        try:
            os.kill(worker, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("the worker still runs")
