"""A page of a studio: its line for errors, and its tasks for the workers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any

from bokeh.document import Document

from drake_navbench.errors import NavbenchError
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.style import html, lines


class Page:
    """Base of the pages; a page is made anew for each tab."""

    def __init__(self, document: Document, desk: Desk) -> None:
        self._document, self._desk = document, desk
        self._line = html(name="line")

    def _say(self, text: str, kind: str = "bad") -> None:
        """Shows a line; kind: 'bad', 'good' or 'soft'."""
        self._line.text = str(lines([text], kind)) if text else ""

    def _try(self, function: Callable[[], Any]) -> bool:
        """Does a step of the user, or shows its error as a line; returns whether it was done."""
        self._say("")
        try:
            function()
        except NavbenchError as error:
            self._say(str(error))
            return False
        return True

    def _ask(
        self,
        begin: Callable[[], Future[Any]],
        show: Callable[[Any], Any],
        always: Callable[[], None] = lambda: None,
    ) -> bool:
        """Gives a worker a task; shows its result when it is ready, or its error as a line.

        begin: begins the task. always: is called when the task has ended in any way. Returns
        whether the task began.
        """
        try:
            begun = begin()
        except NavbenchError as error:
            self._say(str(error))
            return False

        def ended(done: Future[Any]) -> None:
            always()
            error = done.exception()
            if error is not None:
                self._say(str(error))
            else:
                show(done.result())

        def on_page(done: Future[Any]) -> None:
            # Nothing is shown on a closed page.
            with suppress(RuntimeError, ValueError, AttributeError):
                self._document.add_next_tick_callback(partial(ended, done))

        begun.add_done_callback(on_page)
        return True
