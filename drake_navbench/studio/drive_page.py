"""The page Drive: a column, its parameters, the trial, and the one before it."""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial
from typing import Any

from bokeh.document import Document
from bokeh.models import Button, Column, Row, Select, TextInput
from markupsafe import Markup

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.messages import DrawnScenario, Driven
from drake_navbench.studio.open_scenario import files_of
from drake_navbench.studio.page import Page
from drake_navbench.studio.parameter_fields import ParameterField
from drake_navbench.studio.parameter_form import ParameterForm
from drake_navbench.studio.scene_items import items_of
from drake_navbench.studio.style import WIDE, fill, html, lines, styled
from drake_navbench.studio.trial_pictures import TrialPictures, metrics_table

REFRESH_MS = 700
DRAWN = "drawn"
WARMING = "The workers are loading; the very first trial compiles kernels, which takes a minute."


class DrivePage(Page):
    """The desk's column in the desk's scenario."""

    def __init__(self, document: Document, desk: Desk) -> None:
        super().__init__(document, desk)
        self._seen: Any = None
        self._shown: Driven | None = None
        self._is_driving = False
        self._make_widgets()
        self._form = ParameterForm(self._change, self._say)
        self._pictures = TrialPictures()
        main = Column(
            self._line,
            self._pictures.floor,
            self._pictures.speed,
            self._metrics,
            self._patch,
            sizing_mode="stretch_width",
            spacing=8,
        )
        fill(document, "drive", str(desk.folder.root), main=main, side=self._side())
        self._show_column()
        self._show_trials()
        self._watch()
        document.add_periodic_callback(self._watch, REFRESH_MS)

    def _make_widgets(self) -> None:
        desk = self._desk
        self._scenario = Select(
            title="Scenario", options=self._scenarios(), value=DRAWN, name="scenario", **WIDE
        )
        self._robot = Select(
            title="Robot", options=desk.robots(), value=desk.robot, name="robot", **WIDE
        )
        self._column = Select(title="Controller", options=[], name="column", **WIDE)
        self._save_as = TextInput(title="Save as", name="save as", **WIDE)
        self._drive = Button(label="Drive", button_type="primary", width=90, name="drive")
        self._stop = Button(label="Stop", width=60, disabled=True)
        self._lock = Button(label="Lock as reference", sizing_mode="stretch_width", name="lock")
        self._save = Button(label="Save", width=70, name="save", align="end")
        styled(self._scenario, self._robot, self._column, self._save_as)
        styled(self._drive, self._stop, self._lock, self._save)
        self._metrics = html(name="metrics")
        self._patch = html(name="patch")
        self._list_columns()
        self._scenario.on_change("value", self._choose_scenario)
        self._robot.on_change("value", self._choose_robot)
        self._column.on_change("value", self._choose_column)
        self._drive.on_click(self._begin)
        self._stop.on_click(desk.engine.stop_driving)
        self._lock.on_click(self._lock_now)
        self._save.on_click(self._save_file)

    def _side(self) -> Column:
        return Column(
            self._scenario,
            self._robot,
            self._column,
            Row(self._drive, self._stop, spacing=6),
            self._lock,
            Row(self._save_as, self._save, sizing_mode="stretch_width", spacing=6),
            self._form.root,
            sizing_mode="stretch_width",
            spacing=8,
        )

    def _scenarios(self) -> list[tuple[str, str]]:
        return [
            (DRAWN, f"as drawn: {self._desk.scenario.name}"),
            *((f"file:{name}", name) for name in files_of(self._desk.folder, "scenario")),
            *((f"built-in:{name}", name) for name in SCENARIO_FILES.names),
        ]

    # The column.

    def _list_columns(self) -> None:
        """Lists the presets, and the controllers of Nav2 files as workers have read them."""
        tuning = self._desk.tuning
        options = [(f":{name}", name) for name in preset_files()]
        self._column.update(options=options, value=f"{tuning.file}:{tuning.name}")
        for file in files_of(self._desk.folder, "nav2"):
            self._ask(partial(self._columns_in, file), partial(self._list_file, file))

    def _columns_in(self, file: str) -> Future[list[str]]:
        desk = self._desk
        path, text = str(desk.folder.inside(file)), desk.folder.read(file).text
        return desk.engine.look("columns_in", path, text, desk.robot_argument())

    def _list_file(self, file: str, names: list[str]) -> None:
        options = [(f"{file}:{name}", f"{file}: {name}") for name in names]
        others = [entry for entry in self._column.options if entry not in options]
        self._column.options = [*options, *others]

    def _choose_column(self, _name: str, _old: str, chosen: str) -> None:
        file, _, name = chosen.rpartition(":")
        if (file, name) == (self._desk.tuning.file, self._desk.tuning.name):
            return
        self._try(lambda: self._desk.tuning.choose(file, name))
        self._show_column()

    def _show_column(self) -> None:
        tuning = self._desk.tuning
        self._save_as.update(value=tuning.file, visible=bool(tuning.file))
        self._save.visible = bool(tuning.file)
        self._show_patch()
        self._ask(
            lambda: self._desk.engine.look(
                "column_fields", tuning.column(is_changed=False), self._desk.robot_argument()
            ),
            lambda fields: self._form.show(
                fields, tuning.changes, "file" if tuning.file else "preset"
            ),
        )

    def _change(self, field: ParameterField, value: Any) -> None:
        self._desk.tuning.change(field, value)
        self._show_patch()

    def _show_patch(self) -> None:
        try:
            text = self._desk.tuning.patch()
        except NavbenchError as error:
            self._patch.text = str(lines([str(error)], "bad"))
            return
        shown = Markup("<h3>Difference</h3><pre>{}</pre>").format(text) if text else ""
        self._patch.text = str(shown)

    def _save_file(self) -> None:
        def save() -> None:
            self._desk.tuning.save(self._save_as.value.strip())
            self._say(f"{self._desk.tuning.file}: saved", "good")
            self._list_columns()
            self._show_column()

        self._try(save)

    # Scenario, robot, trial.

    def _choose_scenario(self, _name: str, _old: str, chosen: str) -> None:
        kind, _, name = chosen.partition(":")
        if kind != DRAWN:
            self._try(lambda: self._desk.scenario.open(kind, name))
        self._watch()
        # The list shows the scenario that is open, also if the chosen one could not be opened.
        self._scenario.value = DRAWN

    def _choose_robot(self, _name: str, _old: str, robot: str) -> None:
        self._desk.robot = robot
        self._show_column()

    def _watch(self) -> None:
        """Shows the scenario as it is drawn now, on whichever page, and the latest trial."""
        scenario = self._desk.scenario
        if self._shown is not self._desk.tuning.now:
            self._show_trials()
        if self._seen == (scenario.opened, scenario.drawing.version, scenario.name):
            return
        self._seen = (scenario.opened, scenario.drawing.version, scenario.name)
        self._pictures.show_scene(items_of(scenario.drawing.content, scenario.floor))
        self._scenario.update(options=self._scenarios(), value=DRAWN)

    def _begin(self) -> None:
        if self._is_driving:
            return
        desk, scenario = self._desk, self._desk.scenario

        def begin() -> Future[Driven]:
            drawn = DrawnScenario(scenario.drawing.content, scenario.path)
            column, robot = desk.tuning.column(), desk.robot_argument()
            log = desk.engine.new_log()
            begun: Future[Driven] = desk.engine.drive("drive_column", drawn, column, robot, log)
            begun.add_done_callback(desk.tuning.note)
            return begun

        self._say("driving ..." if desk.engine.is_warm else WARMING, "soft")
        if self._ask(begin, self._driven, lambda: self._set_driving(False)):
            self._set_driving(True)

    def _driven(self, driven: Driven) -> None:
        kind = "good" if driven.outcome == "succeeded" else "bad"
        told = (
            f"{driven.column}: {driven.outcome} after {driven.times_s[-1]:.1f} s, {driven.reason}"
        )
        self._line.text = str(
            lines([told], kind) + lines([f"driven in {driven.took_s:.2f} s", *driven.notes], "soft")
        )
        self._show_trials()

    def _set_driving(self, is_driving: bool) -> None:
        self._is_driving = is_driving
        self._drive.disabled, self._stop.disabled = is_driving, not is_driving

    def _lock_now(self) -> None:
        self._desk.tuning.lock()
        self._show_trials()

    def _show_trials(self) -> None:
        tuning = self._desk.tuning
        self._shown = tuning.now
        self._pictures.show(
            {"now": tuning.now, "before": tuning.before, "reference": tuning.reference}
        )
        metrics = self._desk.engine.metrics
        if tuning.now is not None and metrics.done() and metrics.exception() is None:
            shown = metrics_table(metrics.result(), tuning.now, tuning.before, tuning.reference)
            self._metrics.text = str(shown)
