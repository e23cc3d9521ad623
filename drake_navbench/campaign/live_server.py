"""Serves one page to browsers on this machine; they load it anew when it is replaced."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from http.client import HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit
from urllib.request import urlopen

from drake_navbench.errors import InputError

HOST = "localhost"
OWN_NAMES = (HOST, "127.0.0.1", "::1")
# The page asks this path for its number now and then, and reloads itself when the number has
# changed.
NUMBER_PATH = "/number"
PAGE_PATH = "/"
ICON_PATH = "/favicon.ico"
# The paths under which Meshcat keeps the assets of its scene.
ASSET_PATH = re.compile(r"/cas-v1/[A-Za-z0-9._-]{1,200}")
# The answer before the first page: a browser may open the address as soon as it is printed.
NO_PAGE_YET = (
    '<!doctype html><meta http-equiv="refresh" content="1"><link rel="icon" href="data:,">'
    "<title>live</title><p>The first trial is being prepared ..."
)
# The time for a browser's request, and for Meshcat's answer, s. The server looks this often, s,
# whether the run has ended.
PATIENCE_S, POLL_S = 10.0, 0.05


class _QuietServer(ThreadingHTTPServer):
    """Ends a connection silently if it sends no request, or closes before the answer."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Logs nothing: the terminal is for the trials."""


def _is_from_here(hosts: Sequence[str] | None, origin: str | None) -> bool:
    """Whether a request names this machine, and comes from no page of another place.

    Otherwise any page in the same browser could read ours, by a name of its own for this machine.
    The port may be another one, as through a tunnel.
    """
    if hosts is None or len(hosts) != 1:
        return False
    try:
        name = urlsplit(f"http://{hosts[0]}").hostname
    except ValueError:
        return False
    return name in OWN_NAMES and origin in (None, f"http://{hosts[0]}")


class LiveServer:
    """An HTTP server, for a `with` statement.

    scene_address: address of the Meshcat whose scene the pages show, which has its textures. port:
    0 for a free one. Raises InputError where the port is taken.
    """

    def __init__(self, scene_address: str = "", *, port: int = 0) -> None:
        self._scene_address = scene_address
        self._page = NO_PAGE_YET.encode()
        self._number = 0
        own = self

        class Handler(BaseHTTPRequestHandler):
            timeout = PATIENCE_S

            def do_GET(self) -> None:
                if not _is_from_here(self.headers.get_all("Host"), self.headers.get("Origin")):
                    self.send_error(403)
                    return
                try:
                    answer = own._answer(self.path)
                except (OSError, ValueError, HTTPException):
                    # Meshcat has no such asset, or is gone.
                    answer = None
                if answer is None:
                    self.send_error(404)
                    return
                kind, body = answer
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *arguments: Any) -> None:
                """Logs nothing: the terminal is for the trials."""

        try:
            self._server = _QuietServer((HOST, port), Handler)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"--live-port {port}: cannot be listened at: {reason}") from error
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(POLL_S,), daemon=True
        )

    @property
    def address(self) -> str:
        """The URL of the page."""
        return f"http://{HOST}:{self._server.server_port}/"

    def show(self, page: str) -> None:
        """Serves a page from now on."""
        self._page = page.encode()
        self._number += 1

    def _answer(self, path: str) -> tuple[str, bytes] | None:
        """Returns the media type and the content for a path, None where there is no such file."""
        if path == PAGE_PATH:
            return "text/html; charset=utf-8", self._page
        if path == ICON_PATH:
            # Every browser asks for an icon.
            return "image/x-icon", b""
        if path == NUMBER_PATH:
            return "text/plain", str(self._number).encode()
        if ASSET_PATH.fullmatch(path):
            # A page may load textures only from its own address.
            with urlopen(f"{self._scene_address}{path}", timeout=PATIENCE_S) as answer:
                return answer.headers.get_content_type(), answer.read()
        return None

    def __enter__(self) -> LiveServer:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._server.shutdown()
        self._server.server_close()
