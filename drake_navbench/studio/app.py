"""The studio as a whole: its pages behind its server, on a folder of its own."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from bokeh.core.validation import silence
from bokeh.core.validation.warnings import EMPTY_LAYOUT
from bokeh.document import Document
from tornado.ioloop import IOLoop

from drake_navbench.studio.desk import Desk
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.server import HOST, StudioServer, bound

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


def serve(folder: OpenFolder, port: int, told: Callable[[str], None]) -> None:
    """Serves a studio until Ctrl-C or a signal to end.

    told: gets the address. Raises InputError where the port is taken or another studio has the
    folder.
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

    with bound(port) as listening, folder.lock(_told_of(listening)):
        desk.append(Desk(folder))
        try:
            pages = {name: partial(page, name) for name in PAGES}
            server = StudioServer(pages, folder, listening)
            told(server.address)
            server.run()
        finally:
            desk[0].close()


def _told_of(listening: socket.socket) -> str:
    return f"process {os.getpid()}, http://{HOST}:{listening.getsockname()[1]}"
