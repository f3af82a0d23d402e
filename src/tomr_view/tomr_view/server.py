"""A small web server for one page and its WebSocket, in a thread of its own.

What comes from clients is never trusted: paths are looked up in a table and never touch the disk,
messages are small JSON objects of known kinds or end the connection, and a client that does not
read what it is sent loses pictures and then its place.
"""

import asyncio
import json
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from http import HTTPStatus
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection, broadcast, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from tomr_power_model.errors import InputError
from tomr_view.picture import Json

TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
SOCKET = "/socket"
MOST_CLIENTS = 128
MOST_ASKED = 600  # pictures in one answer
LONGEST_MESSAGE = 1024  # bytes from a client
_BACKLOG = 256 * 1024  # bytes that a client may leave unread before it misses pictures
_PATIENCE = 10.0  # s that it may do so
_START_TIMEOUT = 10.0  # s
_POLICY = {
    "Content-Security-Policy": "default-src 'self'; connect-src 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


class Refused(ValueError):
    """A message of a client that is not answered."""


def page_files() -> dict[str, tuple[str, bytes]]:
    """Type and content of every path that is served."""
    folder = files("tomr_view").joinpath("page")
    found = {
        f"/{entry.name}": (TYPES[f".{entry.name.rpartition('.')[2]}"], entry.read_bytes())
        for entry in folder.iterdir()
        if f".{entry.name.rpartition('.')[2]}" in TYPES
    }
    return {**found, "/": found["/index.html"]}


class Server:
    """Serves the page, and sends every client each picture, with the ones before it at first."""

    def __init__(
        self,
        hello: Json,
        pictures: Sequence[Json] = (),
        *,
        kept: int | None = None,
        command: Callable[[Json], None] | None = None,
    ) -> None:
        """`hello` is what a page learns first; `kept` pictures are remembered, None: all.
        `command` receives what pages ask of the robot; without it nothing may be asked."""
        self._hello = hello
        self._command = command
        self._pages = page_files()
        self._pictures: deque[str] = deque(map(_text, pictures), maxlen=kept)
        self._clients: dict[ServerConnection, float] = {}  # since when each does not read
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="web server", daemon=True)
        self._stop = asyncio.Event()
        self._started: threading.Event = threading.Event()
        self._failure: OSError | None = None
        self.address = ""

    def start(self, host: str, port: int) -> None:
        """Serve from now on; port 0 takes any. Raises InputError if the port is not to be had."""
        self._host, self._port = host, port
        self._thread.start()
        self._started.wait(_START_TIMEOUT)
        if self._failure is not None or not self.address:
            reason = getattr(self._failure, "strerror", None) or "no answer"
            raise InputError(f"--port {port} of {host}: cannot be used ({reason}): take another")

    def show(self, picture: Json) -> None:
        """Send a picture to all clients; from any thread."""
        self._loop.call_soon_threadsafe(self._send, _text(picture))

    def update(self, **hello: Any) -> None:
        """Change what new pages learn first, and inform those that are there; from any thread."""
        self._loop.call_soon_threadsafe(self._renew, hello)

    def close(self) -> None:
        """End all connections and the thread."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join(_START_TIMEOUT)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._failure = error
            self._started.set()
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        quiet = logging.getLogger("tomr_view.clients")  # garbage of clients is no news
        quiet.addHandler(logging.NullHandler())
        quiet.propagate = False
        async with serve(
            self._meet,
            self._host,
            self._port,
            process_request=self._answer,
            max_size=LONGEST_MESSAGE,
            max_queue=4,
            compression=None,
            close_timeout=1.0,
            logger=quiet,
        ) as server:
            host, port = next(iter(server.sockets)).getsockname()[:2]
            self.address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
            self._started.set()
            await self._stop.wait()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The page, or None for a WebSocket, which the library then opens."""
        path = urlsplit(request.path).path
        if path == SOCKET:
            if not _is_own_page(request.headers):
                return connection.respond(HTTPStatus.FORBIDDEN, "of another page\n")
            if len(self._clients) >= MOST_CLIENTS:
                return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many pages\n")
            return None
        if path not in self._pages:
            return connection.respond(HTTPStatus.NOT_FOUND, "no such page\n")
        kind, content = self._pages[path]
        headers = Headers(
            {
                "Content-Type": f"{kind}; charset=utf-8",
                "Content-Length": str(len(content)),
                "Connection": "close",
                **_POLICY,
            }
        )
        return Response(HTTPStatus.OK.value, HTTPStatus.OK.phrase, headers, content)

    async def _meet(self, connection: ServerConnection) -> None:
        """Serve one client until it leaves or sends what it should not."""
        last = len(self._pictures) if self._hello["mode"] == "live" else 0
        await connection.send(_text({"kind": "hello", **self._hello}))
        await connection.send(self._range(0, last))
        self._clients[connection] = 0.0
        try:
            async for message in connection:
                answer = self._asked(message)
                if answer is not None:
                    await connection.send(answer)
        except Refused as error:
            await connection.close(1008, str(error))
        except ConnectionClosed:
            pass
        finally:
            del self._clients[connection]

    def _asked(self, message: str | bytes) -> str | None:
        """What to answer; raises Refused."""
        try:
            asked = json.loads(message)
        except (ValueError, RecursionError):
            raise Refused("not JSON") from None
        if not isinstance(asked, dict):
            raise Refused("not an object")
        if asked.get("ask") == "pictures":
            first, count = (_index(asked, name) for name in ("first", "count"))
            return self._range(first, min(count, MOST_ASKED))
        if asked.get("ask") == "fault" and self._command is not None:
            self._command(asked)
            return None
        raise Refused("nothing that can be asked for")

    def _range(self, first: int, count: int) -> str:
        texts = [self._pictures[i] for i in range(first, min(first + count, len(self._pictures)))]
        return f'{{"kind":"pictures","first":{first},"pictures":[{",".join(texts)}]}}'

    def _send(self, text: str) -> None:
        self._pictures.append(text)
        now = time.monotonic()
        ready = []
        for connection, stuck in list(self._clients.items()):
            if connection.transport.get_write_buffer_size() < _BACKLOG:
                self._clients[connection] = 0.0
                ready.append(connection)
            elif not stuck:
                self._clients[connection] = now
            elif now - stuck > _PATIENCE:
                connection.transport.abort()
        broadcast(ready, f'{{"kind":"picture","picture":{text}}}')

    def _renew(self, hello: Mapping[str, Any]) -> None:
        self._hello = {**self._hello, **hello}
        broadcast(list(self._clients), _text({"kind": "update", **hello}))


def _text(value: Json) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _index(asked: Mapping[str, object], name: str) -> int:
    value = asked.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**31:
        raise Refused(f"{name} is no whole number")
    return value


def _is_own_page(headers: Headers) -> bool:
    """Whether a WebSocket is asked for by our page, or by a program: a browser says of which page
    it is, and another site's page must not steer a robot."""
    origin = headers.get("Origin")
    return origin is None or urlsplit(origin).netloc == headers.get("Host")
