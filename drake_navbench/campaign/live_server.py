"""Serves one page to browsers on this machine, and tells them when there is another."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from typing import Any
from urllib.request import urlopen

HOST = "localhost"
# The page asks for it now and then, and loads itself anew when it has changed.
NUMBER_PATH = "/number"
# Where Meshcat has what its scene is made of.
ASSETS_PATH = "/cas-v1/"


class LiveServer:
    """An HTTP server on a free port, for a `with` statement.

    scene_address: of the Meshcat whose scene the pages show, which has its textures.
    """

    def __init__(self, scene_address: str = "") -> None:
        self._scene_address = scene_address
        self._page = b""
        self._number = 0
        own = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                try:
                    kind, body = own._answer(self.path)
                except OSError:
                    self.send_error(404)
                    return
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *arguments: Any) -> None:
                """Says nothing: the terminal is for the trials."""

        self._server = ThreadingHTTPServer((HOST, 0), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        return f"http://{HOST}:{self._server.server_port}/"

    def show(self, page: str) -> None:
        """Serves a page from now on."""
        self._page = page.encode()
        self._number += 1

    def _answer(self, path: str) -> tuple[str, bytes]:
        """Returns the kind and the content of what is asked for; raises OSError."""
        if path == NUMBER_PATH:
            return "text/plain", str(self._number).encode()
        if path.startswith(ASSETS_PATH):
            # A page may load textures from where it comes from only.
            with urlopen(f"{self._scene_address}{path}") as answer:
                return answer.headers.get_content_type(), answer.read()
        return "text/html; charset=utf-8", self._page

    def __enter__(self) -> LiveServer:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
