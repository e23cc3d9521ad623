"""The server of a studio: Bokeh's, on loopback, with a token, only for its own addresses."""

from __future__ import annotations

import os
import secrets
import signal
import socket
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from bokeh.core.validation import silence
from bokeh.core.validation.warnings import EMPTY_LAYOUT
from bokeh.document import Document
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.settings import settings
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.web import ErrorHandler, HTTPError, RedirectHandler, RequestHandler

from drake_navbench.errors import InputError
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.open_folder import OpenFolder

HOST = "127.0.0.1"
TOKEN_BYTES = 18
# Reports and replays are pages of results folders. They run their scripts in an origin of their
# own, so that they can reach neither the studio nor any other host.
SHOWN_SUFFIXES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml",
}
POLICY = (
    "sandbox allow-scripts allow-popups; default-src 'none'; script-src 'unsafe-inline' "
    "'unsafe-eval' blob: data: {files}; style-src 'unsafe-inline'; img-src data: blob: {files}; "
    "font-src data:; connect-src data: blob:; worker-src blob: data:; media-src data: blob:"
)
MAX_PAGE_BYTES = 500_000_000
# The session of a closed page is kept this long, for a reload.
UNUSED_SESSION_MS = 5_000
# The class of each page. A page's module is imported when the page is first opened, so that the
# first page appears at once.
PAGES = {
    "runs": ("runs_page", "RunsPage"),
    "scenario": ("scenario_page", "ScenarioPage"),
    "drive": ("drive_page", "DrivePage"),
    "live": ("live_page", "LivePage"),
}
# After this time the first page has surely been sent.
LOAD_AFTER_S = 0.7


class _Guarded(BokehTornado):
    """Bokeh's application, which refuses requests with another host name.

    Another site may let its name point to loopback; its pages' requests then have that name.
    """

    own_hosts: frozenset[str] = frozenset()

    def find_handler(self, request: HTTPServerRequest, **arguments: Any) -> Any:
        origin = request.headers.get("Origin")
        is_own = request.host in self.own_hosts and (
            origin is None or origin.removeprefix("http://") in self.own_hosts
        )
        if not is_own:
            return self.get_handler_delegate(request, ErrorHandler, {"status_code": 403})
        return super().find_handler(request, **arguments)


class _ShownFile(RequestHandler):
    """A page of a results folder below the studio's folder."""

    def initialize(self, folder: OpenFolder, root: str) -> None:
        self._folder, self._root = folder, root

    def get(self, name: str) -> None:
        try:
            path = self._folder.inside(name)
        except InputError as error:
            raise HTTPError(404) from error
        kind = SHOWN_SUFFIXES.get(path.suffix)
        if kind is None or not path.is_file() or path.stat().st_size > MAX_PAGE_BYTES:
            raise HTTPError(404)
        self.set_header("Content-Type", kind)
        files = f"http://{self.request.host}{self._root}"
        self.set_header("Content-Security-Policy", POLICY.format(files=files))
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.write(Path(path).read_bytes())


class StudioServer:
    """A server of pages.

    pages: page name -> the function that fills its document. listening: see `bound`.
    """

    def __init__(
        self,
        pages: Mapping[str, Callable[[Document], None]],
        folder: OpenFolder,
        listening: socket.socket,
    ) -> None:
        settings.resources = "server"
        port = listening.getsockname()[1]
        token = secrets.token_urlsafe(TOKEN_BYTES)
        first = next(iter(pages))
        self.address = f"http://{HOST}:{port}/{token}/{first}"
        hosts = frozenset({f"{HOST}:{port}", f"localhost:{port}"})
        application = _Guarded(
            {f"/{name}": page for name, page in pages.items()},
            prefix=token,
            extra_websocket_origins=sorted(hosts),
            extra_patterns=[
                (r"/file/(.+)", _ShownFile, {"folder": folder, "root": f"/{token}/file/"}),
                (r"/?", RedirectHandler, {"url": f"/{token}/{first}", "permanent": False}),
            ],
            use_index=False,
            unused_session_lifetime_milliseconds=UNUSED_SESSION_MS,
            check_unused_sessions_milliseconds=UNUSED_SESSION_MS,
        )
        application.own_hosts = hosts
        self._loop: Any = IOLoop.current()
        http = HTTPServer(application)
        http.add_socket(listening)
        self._server = BaseServer(self._loop, application, http)

    def run(self) -> None:
        """Serves until Ctrl-C or a signal to end."""
        self._server.start()
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                self._loop.asyncio_loop.add_signal_handler(number, self._loop.stop)
            self._loop.start()
        finally:
            self._server.stop()


def bound(port: int) -> socket.socket:
    """Returns a loopback socket that listens at a port; raises InputError if the port is taken."""
    one = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        one.bind((HOST, port))
    except (OSError, OverflowError) as error:
        one.close()
        raise InputError(
            f"--port {port}: cannot be used ({getattr(error, 'strerror', None) or error}); "
            "expected a free one, or 0 for any"
        ) from error
    one.setblocking(False)
    one.listen(128)
    return one


def serve(
    folder: OpenFolder,
    port: int,
    told: Callable[[str], None],
    ways: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Serves a studio until Ctrl-C or a signal to end.

    told: gets the address. ways: scenarios to open, as from `ways_between`. Raises InputError where
    the port is taken or another studio has the folder.
    """
    # A column of inputs may be empty for a while.
    silence(EMPTY_LAYOUT)
    desk: list[Desk] = []

    def page(name: str, document: Document) -> None:
        module, kind = PAGES[name]
        made: Any = getattr(import_module(f"drake_navbench.studio.{module}"), kind)
        made(document, desk[0])
        IOLoop.current().call_later(LOAD_AFTER_S, load)

    def load() -> None:
        """Imports the modules of the other pages while the user looks at the first one."""
        for module, _ in PAGES.values():
            import_module(f"drake_navbench.studio.{module}")

    with bound(port) as listening, folder.lock(_lock_owner(listening)):
        desk.append(Desk(folder, ways or {}))
        try:
            pages = {name: partial(page, name) for name in PAGES}
            server = StudioServer(pages, folder, listening)
            told(server.address)
            server.run()
        finally:
            desk[0].close()


def _lock_owner(listening: socket.socket) -> str:
    return f"process {os.getpid()}, http://{HOST}:{listening.getsockname()[1]}"
