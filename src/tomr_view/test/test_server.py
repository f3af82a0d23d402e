"""The web server against clients of all kinds."""

import asyncio
import http.client
import json
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from websockets.asyncio.client import connect as connect_async
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from tomr_power_model.errors import InputError
from tomr_view.server import MOST_ASKED, MOST_CLIENTS, Server

WAIT = 10.0  # s


@pytest.fixture
def asked() -> list[dict[str, Any]]:
    return []


@pytest.fixture
def server(asked: list[dict[str, Any]]) -> Iterator[Server]:
    found = Server({"mode": "live", "faults": []}, [{"t": 0}], kept=3, command=asked.append)
    found.start("127.0.0.1", 0)
    yield found
    found.close()


def at(server: Server) -> str:
    return server.address.removeprefix("http://").rstrip("/")


def page(server: Server, **options: Any) -> ClientConnection:
    return connect(f"ws://{at(server)}/socket", **options)


def received(client: ClientConnection) -> dict[str, Any]:
    return json.loads(client.recv(WAIT))


def get(server: Server, path: str, method: str = "GET") -> tuple[int, bytes]:
    connection = http.client.HTTPConnection(at(server), timeout=WAIT)
    connection.request(method, path)
    response = connection.getresponse()
    return response.status, response.read()


def test_a_page_gets_what_was_and_what_comes(server: Server) -> None:
    with page(server) as client:
        assert received(client)["kind"] == "hello"
        assert received(client) == {"kind": "pictures", "first": 0, "pictures": [{"t": 0}]}
        for t in range(1, 6):
            server.show({"t": t})
            assert received(client) == {"kind": "picture", "picture": {"t": t}}
        server.update(faults=["x"])
        assert received(client) == {"kind": "update", "faults": ["x"]}
    with page(server) as client:  # only the last three are kept
        assert received(client)["faults"] == ["x"]
        assert [picture["t"] for picture in received(client)["pictures"]] == [3, 4, 5]


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/", 200),
        ("/view.js", 200),
        ("/view.css?x=1", 200),
        ("/../../../../etc/passwd", 404),
        ("/%2e%2e/%2e%2e/etc/passwd", 404),
        ("//etc/passwd", 404),
        ("/server.py", 404),
        ("/view.js/../../server.py", 404),
        ("/socket", 426),
    ],
)
def test_only_the_page_is_served(server: Server, path: str, status: int) -> None:
    found, body = get(server, path)
    assert found == status
    assert b"root:" not in body


def test_the_page_loads_nothing_from_elsewhere(server: Server) -> None:
    for path in ("/", "/view.js", "/view.css"):
        text = get(server, path)[1].decode()
        assert "http://" not in text
        assert "https://" not in text


@pytest.mark.parametrize(
    ("garbage", "code"),
    [
        ("not json", 1008),
        (b"\x00\xff", 1008),
        ("[1, 2]", 1008),
        ('{"ask": "everything"}', 1008),
        ('{"ask": "pictures"}', 1008),
        ('{"ask": "pictures", "first": -1, "count": 2}', 1008),
        ('{"ask": "pictures", "first": true, "count": 2}', 1008),
        ('{"ask": "pictures", "first": 0, "count": 1e99}', 1008),
        ("[" * 1000, 1008),
        ('{"ask": "pictures", "first": 0, "count": 1, "x": "' + 1000 * "x" + '"}', 1009),
        ("x" * 100_000, 1009),
    ],
)
def test_garbage_ends_its_own_connection_only(
    server: Server, garbage: str | bytes, code: int
) -> None:
    with page(server) as other, page(server) as client:
        received(other), received(other)
        client.send(garbage)
        received(client), received(client)
        with pytest.raises(ConnectionClosed) as closed:
            client.recv(WAIT)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == code
        server.show({"t": 9})
        assert received(other)["picture"] == {"t": 9}


def test_what_is_no_http_is_survived(server: Server) -> None:
    host, port = at(server).split(":")
    for garbage in (b"\x00" * 64, b"GET\r\n\r\n", b"A" * 100_000, b"POST / HTTP/1.1\r\n\r\n"):
        with socket.create_connection((host, int(port)), timeout=WAIT) as raw:
            raw.sendall(garbage)
    assert get(server, "/")[0] == 200


def test_another_site_cannot_steer_the_robot(server: Server, asked: list[Any]) -> None:
    with pytest.raises(InvalidStatus) as refused, page(server, origin="http://evil.example"):
        pass
    assert refused.value.response.status_code == 403
    with page(server, origin=f"http://{at(server)}") as client:
        received(client), received(client)
        client.send('{"ask": "fault", "id": null}')
        client.send('{"ask": "pictures", "first": 0, "count": 1}')
        received(client)  # by now the wish before it has been heard
    assert asked == [{"ask": "fault", "id": None}]


def test_a_server_that_only_shows_takes_no_wishes() -> None:
    server = Server({"mode": "recording"}, [{"t": t} for t in range(2000)])
    server.start("127.0.0.1", 0)
    try:
        with page(server, max_size=None) as client:
            received(client), received(client)
            client.send('{"ask": "pictures", "first": 100, "count": 2}')
            assert [p["t"] for p in received(client)["pictures"]] == [100, 101]
            client.send('{"ask": "pictures", "first": 0, "count": 2000000000}')
            assert len(received(client)["pictures"]) == MOST_ASKED
            client.send('{"ask": "pictures", "first": 99999, "count": 5}')
            assert received(client)["pictures"] == []
            client.send('{"ask": "fault", "id": "encoder_lost"}')
            with pytest.raises(ConnectionClosed, match="nothing that can be asked for"):
                client.recv(WAIT)
    finally:
        server.close()


def deaf_page(server: Server) -> socket.socket:
    """A page that does not read."""
    host, port = at(server).split(":")
    deaf = socket.create_connection((host, int(port)), timeout=WAIT)
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    deaf.sendall(f"GET /socket HTTP/1.1\r\nHost: {host}\r\n{upgrade}{key}\r\n".encode())
    assert deaf.recv(12) == b"HTTP/1.1 101"
    return deaf


LARGE = {"t": 0, "padding": "x" * 50_000}


def test_a_hundred_pages_and_one_that_does_not_read(
    server: Server, wait_until: Callable[..., Any]
) -> None:
    async def hundred() -> int:
        async with asyncio.timeout(60):
            clients = [await connect_async(f"ws://{at(server)}/socket") for _ in range(100)]
            for client in clients:
                await client.recv(), await client.recv()
            server.show({"t": 1})
            heard = [json.loads(await client.recv()) for client in clients]
            for client in clients:
                await client.close()
        return sum(item.get("picture") == {"t": 1} for item in heard)

    with deaf_page(server):
        for _ in range(200):  # 10 MB: more than any buffer on the way
            server.show(LARGE)
        assert asyncio.run(hundred()) == 100
        waiting = [c.transport.get_write_buffer_size() for c in server._clients]
        assert max(waiting, default=0) < 1_000_000  # the deaf one's pictures are not heaped up
    wait_until(lambda: not server._clients, "all pages gone")


def test_a_page_that_never_reads_loses_its_place(
    server: Server, wait_until: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tomr_view.server._PATIENCE", 0.0)

    def gone() -> bool:
        server.show(LARGE)
        return not server._clients

    with deaf_page(server):
        wait_until(lambda: server._clients, "the page")
        wait_until(gone, "the page is sent away")


def test_more_pages_than_it_serves_are_turned_away(server: Server) -> None:
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS):
            client = stack.enter_context(page(server))
            received(client), received(client)
        with pytest.raises(InvalidStatus) as refused:
            stack.enter_context(page(server))
        assert refused.value.response.status_code == 503


def test_a_port_in_use_is_refused_in_one_line(server: Server) -> None:
    port = int(at(server).split(":")[1])
    with pytest.raises(InputError, match=f"--port {port} of 127.0.0.1: cannot be used"):
        Server({"mode": "live"}).start("127.0.0.1", port)
