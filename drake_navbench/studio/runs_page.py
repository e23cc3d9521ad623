"""The page Runs: a card a run, with its verdict, progress, differences, and what can be opened."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from bokeh.document import Document
from bokeh.models import Button, Column, Row
from markupsafe import Markup

from drake_navbench.studio.desk import Desk
from drake_navbench.studio.page import Page
from drake_navbench.studio.run_states import RunState, run_states
from drake_navbench.studio.style import card, fill, lines, styled

REFRESH_MS = 1500
MAX_SHOWN = 40
EMPTY = Markup(
    "<h2>Begin here</h2>"
    '<p><a href="scenario">Scenario</a> draw a floor, or open a scenario, a map or a world</p>'
    '<p><a href="drive">Drive</a> drive one trial in it, change a parameter, drive again</p>'
    '<p><a href="live">Live</a> step through a trial: why did it turn left there?</p>'
    '<p class="soft">This page lists the runs of <code>drake-navbench run SCENARIO --out '
    "results/NAME</code> in this folder; there are none yet.</p>"
)


class RunsPage(Page):
    """The list of runs, made again when anything in it has changed."""

    def __init__(self, document: Document, desk: Desk) -> None:
        super().__init__(document, desk)
        self._shown: Any = None
        self._list = Column(sizing_mode="stretch_width", spacing=10)
        main = Column(self._line, self._list, sizing_mode="stretch_width")
        self._refresh()
        fill(document, "runs", str(desk.folder.root), main=main)
        document.add_periodic_callback(self._refresh, REFRESH_MS)

    def _refresh(self) -> None:
        states = run_states(self._desk.folder)[:MAX_SHOWN]
        jobs = self._desk.jobs
        shown = [
            (state, jobs.is_running(state.path), jobs.told.get(state.path)) for state in states
        ]
        if shown == self._shown:
            return
        self._shown = shown
        self._list.children = [self._card(*entry) for entry in shown] or [
            card(text=EMPTY, name="empty")
        ]

    def _card(self, state: RunState, is_own: bool, told: str | None) -> Any:
        text = card(text=_text(state, told), name=f"card {state.run.name}")
        resume = Button(
            label="Resume",
            disabled=is_own or not state.can_resume,
            width=80,
            name=f"resume {state.run.name}",
        )
        resume.on_click(partial(self._resume, state.path))
        again = Button(
            label="Run again",
            disabled=state.total is None,
            width=90,
            name=f"again {state.run.name}",
        )
        again.on_click(partial(self._again, state))
        stop = Button(label="Stop", visible=is_own, width=60, name=f"stop {state.run.name}")
        stop.on_click(partial(self._desk.jobs.stop, state.path))
        buttons = Row(*styled(resume, again, stop), spacing=6)
        return Column(text, buttons, sizing_mode="stretch_width", spacing=4)

    def _resume(self, path: Path) -> None:
        self._try(lambda: self._desk.resume(path))
        self._refresh()

    def _again(self, state: RunState) -> None:
        self._say("")
        self._ask(lambda: self._desk.begin_again(state.path), self._resume)


def _text(state: RunState, told: str | None) -> Markup:
    run = state.run
    tags = Markup("").join(Markup('<span class="tag">{}</span>').format(tag) for tag in run.tags)
    parts = [
        Markup("<h2>{}{}</h2>").format(run.name, tags),
        Markup('<p class="soft">{} · {}</p>').format(run.created.replace("T", " ")[:16], run.what),
    ]
    is_open = state.is_running or state.can_resume
    if state.total and is_open:
        share = min(100.0 * state.done / state.total, 100.0)
        word = "running" if state.is_running else "stopped"
        parts.append(Markup('<div class="bar"><i style="width:{:.1f}%"></i></div>').format(share))
        parts.append(lines([f"{word}: {state.done} of {state.total} trials"]))
    if run.verdict:
        parts.append(lines([run.verdict]))
    if state.changed:
        parts.append(lines(["since the run before: " + "; ".join(state.changed)], "soft"))
    if told:
        parts.append(lines([told], "bad"))
    links = Markup("").join(
        Markup('<a href="file/{}" target="_blank" rel="noopener">{}</a>').format(name, title)
        for title, name in state.pages
    )
    return Markup("").join([*parts, links])
