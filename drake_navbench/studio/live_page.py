"""The page Live: a trial from its log at any speed, with costmap and diagnostics of each moment."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import Button, Column, ColumnDataSource, Row, Select, Slider
from markupsafe import Markup

from drake_navbench.studio import style
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.moments import (
    Moment,
    Reasons,
    Watched,
    image_of,
    moment_at,
    rows_of,
    trajectories_of,
)
from drake_navbench.studio.page import Page
from drake_navbench.studio.scene_items import bounds_of, items_of
from drake_navbench.studio.style import (
    MapView,
    coordinates,
    fill,
    html,
    image_at,
    key,
    lines,
    styled,
    table,
)
from drake_navbench.studio.trial_pictures import placed

FRAME_MS = 80
STEP_S = 0.1
SPEEDS = [("0.25", "¼ ×"), ("0.5", "½ ×"), ("1", "1 ×"), ("2", "2 ×"), ("5", "5 ×")]
OWN = "own:"
KEY = key(
    (
        (style.INK, "plan"),
        (style.NOW, "driven so far"),
        (style.GOAL, "expected by the controller"),
        (style.FAINT_LINE, "its samples (after Why?)"),
    )
)
DRIFTING = (
    "The estimate drifts in this scenario: costmap and trajectories are moved to the robot's true "
    "place, but not turned."
)


class LivePage(Page):
    """A scrubber over one log."""

    def __init__(self, document: Document, desk: Desk) -> None:
        super().__init__(document, desk)
        self._watched: Watched | None = None
        self._is_playing = False
        self._make_widgets()
        self._make_picture()
        main = Column(
            self._line,
            self._map.figure,
            html(KEY),
            self._time,
            Row(*self._buttons, self._speed, self._why, spacing=6),
            self._reason,
            sizing_mode="stretch_width",
            spacing=8,
        )
        side = Column(self._trial, self._rows, sizing_mode="stretch_width", spacing=8)
        fill(document, "live", str(desk.folder.root), main=main, side=side)
        document.add_periodic_callback(self._tick, FRAME_MS)
        if self._trial.options:
            self._trial.value = self._trial.options[0][0]

    def _make_widgets(self) -> None:
        self._trial = Select(
            title="Trial", options=self._choices(), sizing_mode="stretch_width", name="trial"
        )
        self._trial.on_change("value", self._choose)
        self._time = Slider(
            start=0.0,
            end=1.0,
            value=0.0,
            step=0.02,
            title="time [s]",
            bar_color=style.NOW,
            sizing_mode="stretch_width",
            name="time",
        )
        self._time.on_change("value", lambda _name, _old, _new: self._show())
        self._play = Button(label="Play", width=70, button_type="primary", name="play")
        back, ahead = (
            Button(label=label, width=70, name=name)
            for label, name in (("− 0.1 s", "back"), ("+ 0.1 s", "ahead"))
        )
        self._why = Button(label="Why?", width=70, name="why")
        self._speed = Select(options=SPEEDS, value="1", width=80)
        self._play.on_click(self._toggle)
        back.on_click(lambda: self._step(-STEP_S))
        ahead.on_click(lambda: self._step(STEP_S))
        self._why.on_click(self._ask_why)
        self._buttons = styled(self._play, back, ahead)
        styled(self._trial, self._time, self._speed, self._why)
        self._rows, self._reason = html(name="rows"), html(name="reason")

    def _make_picture(self) -> None:
        self._map = MapView(height=480)
        plot = self._map.figure
        self._costs = ColumnDataSource(image_at(None, None))
        self._walls = ColumnDataSource({"xs": [], "ys": []})
        self._lines = ColumnDataSource({"xs": [], "ys": [], "color": [], "width": []})
        self._body = ColumnDataSource({"xs": [], "ys": []})
        plot.image_rgba("image", "x", "y", "dw", "dh", source=self._costs)
        plot.patches("xs", "ys", source=self._walls, color=style.WALL, fill_alpha=0.75)
        plot.multi_line("xs", "ys", source=self._lines, color="color", line_width="width")
        plot.patches("xs", "ys", source=self._body, color=style.NOW, fill_alpha=0.3, line_width=2)

    def _choices(self) -> list[tuple[str, str]]:
        tuning = self._desk.tuning
        named = {"now": tuning.now, "before": tuning.before, "reference": tuning.reference}
        own = [(f"{OWN}{role}", f"{role}: {t.column}") for role, t in named.items() if t]
        return [*own, *((name, name) for name in self._desk.logs())]

    def _choose(self, _name: str, _old: str, _chosen: str) -> None:
        self._watched = None
        self._ask(
            lambda: self._desk.engine.look("read_watched", self._chosen()[0]),
            partial(self._read, self._trial.value),
        )

    def _chosen(self) -> tuple[str, Any]:
        """Returns the path of the chosen log, and of a trial of the studio its inputs."""
        chosen = self._trial.value
        if chosen.startswith(OWN):
            driven = getattr(self._desk.tuning, chosen.removeprefix(OWN))
            return driven.log, driven.drive
        return str(self._desk.folder.inside(chosen)), None

    def _ask_why(self) -> None:
        """Drives the trial once more with all that its controller can tell; it moves the same."""
        watched = self._watched
        if watched is None:
            return

        def ended() -> None:
            self._why.disabled = False

        self._say("driving again, to tell why ...", "soft")
        begin, tell = (
            lambda: self._desk.reasons(*self._chosen()),
            partial(self._show_reasons, watched),
        )
        self._why.disabled = self._ask(begin, tell, ended)

    def _show_reasons(self, watched: Watched, found: Reasons) -> None:
        if watched is not self._watched:
            return
        self._watched = watched._replace(decisions=found.decisions, cycles=found.cycles)
        self._say(watched.title, "soft")
        self._show()

    def _read(self, chosen: str, watched: Watched) -> None:
        if chosen != self._trial.value:
            return
        self._watched = watched
        self._say(watched.title, "soft")
        items = items_of(watched.scenario)
        walls = [item.outline for item in items if item.kind == "wall"]
        self._walls.data = coordinates(walls)
        low_x, low_y, high_x, high_y = bounds_of(items)
        self._map.look_at([low_x - 1.0, low_y - 1.0, high_x + 1.0, high_y + 1.0])
        end_s = float(watched.times_s[-1]) if len(watched.times_s) else 0.0
        self._time.update(start=0.0, end=max(end_s, STEP_S), value=0.0)
        self._show()

    def _toggle(self) -> None:
        self._is_playing = not self._is_playing
        if self._is_playing and self._time.value >= self._time.end - STEP_S:
            self._time.value = 0.0
        self._play.label = "Pause" if self._is_playing else "Play"

    def _step(self, by_s: float) -> None:
        self._is_playing = False
        self._play.label = "Play"
        self._time.value = float(np.clip(self._time.value + by_s, 0.0, self._time.end))

    def _tick(self) -> None:
        if not self._is_playing:
            return
        at_s = self._time.value + 0.001 * FRAME_MS * float(self._speed.value)
        self._time.value = min(at_s, self._time.end)
        if at_s >= self._time.end:
            self._toggle()

    def _show(self) -> None:
        watched = self._watched
        if watched is None or not len(watched.times_s):
            return
        moment = moment_at(watched, self._time.value)
        shift = watched.offset[moment.sample]
        self._show_costmap(moment, shift)
        self._show_lines(watched, moment, shift)
        body = placed(watched.outline, watched.poses[moment.sample])
        self._body.data = coordinates([body])
        notes = lines([DRIFTING], "soft") if watched.is_drifting else Markup("")
        self._rows.text = str(table(["at this moment", ""], rows_of(watched, moment)) + notes)
        self._reason.text = str(decision_as_html(moment.decision)) if moment.decision else ""

    def _show_costmap(self, moment: Moment, shift: np.ndarray) -> None:
        costmap = moment.costmap
        if costmap is None:
            self._costs.data = image_at(None, None)
            return
        x, y = costmap.x + shift[0], costmap.y + shift[1]
        rows, columns = costmap.costs.shape
        bounds = (x, y, x + columns * costmap.edge_m, y + rows * costmap.edge_m)
        self._costs.data = image_at(image_of(costmap), bounds)

    def _show_lines(self, watched: Watched, moment: Moment, shift: np.ndarray) -> None:
        samples, predicted = trajectories_of(moment)
        drawn = [(entry + shift, style.FAINT_LINE, 1.0) for entry in samples]
        drawn += [
            (watched.course, style.INK, 1.5),
            (watched.poses[: moment.sample + 1, :2], style.NOW, 2.0),
        ]
        if predicted is not None:
            drawn.append((predicted + shift, style.GOAL, 2.5))
        self._lines.data = {
            **coordinates(line for line, _, _ in drawn),
            "color": [color for _, color, _ in drawn],
            "width": [width for _, _, width in drawn],
        }


def decision_as_html(decision: Mapping[str, Any]) -> Markup:
    """Returns a decision's reasons as HTML: the sentence, the table, the notes."""
    head = Markup("<h3>why, {:.2f} s</h3>").format(decision["time"])
    shown = table(decision["columns"], decision["rows"]) if decision["rows"] else Markup("")
    return head + lines([decision["sentence"]]) + shown + lines(decision["notes"], "soft")
