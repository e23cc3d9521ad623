"""The page Scenario: draw a scenario, checked while it is drawn, and save it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import yaml
from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    CustomJS,
    InlineStyleSheet,
    PanTool,
    RadioButtonGroup,
    Row,
    Select,
    Spinner,
    TextInput,
)
from markupsafe import Markup

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.kernels.poses import place_outline
from drake_navbench.studio import drawing
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.drawing import entry_at, snapped, with_entry
from drake_navbench.studio.drawing_tools import (
    HINTS,
    MOVE,
    OF_POSES,
    OF_WAYS,
    TOOLS,
    Hold,
    dragged,
    with_way,
)
from drake_navbench.studio.floor_plan import POSES, FloorPlan
from drake_navbench.studio.messages import Asked, Checked, Ground
from drake_navbench.studio.mouse import Place
from drake_navbench.studio.open_scenario import WORLD_SUFFIXES, files_of
from drake_navbench.studio.page import Page
from drake_navbench.studio.scene_items import Item, item_at, items_of
from drake_navbench.studio.style import every, fill, html, lines, styled
from drake_navbench.typed_files.typed_yaml import parse_yaml

STEPS = [("0", "nothing"), ("0.01", "1 cm"), ("0.05", "5 cm"), ("0.1", "10 cm"), ("0.5", "50 cm")]
GRID = (
    ".bk-btn-group { display: grid !important; gap: 4px; "
    "grid-template-columns: repeat(auto-fill, minmax(84px, 1fr)); }"
)
FREE = "The start is free, the goal can be reached, the robot fits through every gap."
CHOOSE, FLOOR = ("", "open or begin ..."), ("new", "new: empty floor")
REFRESH_MS = 700


class ScenarioPage(Page):
    """The drawing of the desk's scenario."""

    def __init__(self, document: Document, desk: Desk) -> None:
        super().__init__(document, desk)
        self._picked: Item | None = None
        self._way_goes_on = False
        self._is_changed = False
        self._seen: Any = None
        self._ground: Ground | None = None
        self._make_widgets()
        self._plan = FloorPlan(self._tool, self._step, self._drag, self._click)
        self._let_pan()
        fill(
            document,
            "scenario",
            str(desk.folder.root),
            side=self._side(),
            main=Column(
                self._plan.figure,
                self._faults,
                self._entry,
                html(Markup("<h3>The file</h3>")),
                self._text,
                sizing_mode="stretch_width",
            ),
        )
        self._opened()
        every(document, REFRESH_MS, self._watch)

    def _make_widgets(self) -> None:
        self._files = Select(
            title="File", options=self._choices(), sizing_mode="stretch_width", name="file"
        )
        self._files.on_change("value", self._choose)
        self._name = TextInput(title="Save as", sizing_mode="stretch_width", name="save as")
        self._description = TextInput(title="Description", sizing_mode="stretch_width")
        self._description.on_change("value", self._describe)
        self._robot = Select(
            title="Robot, for the checks",
            options=self._desk.robots(),
            value=self._desk.robot,
            sizing_mode="stretch_width",
        )
        self._robot.on_change("value", self._choose_robot)
        self._tool = RadioButtonGroup(
            name="tool", labels=TOOLS, active=1, sizing_mode="stretch_width"
        )
        self._tool.stylesheets = [InlineStyleSheet(css=GRID)]
        self._tool.on_change("active", lambda _name, _old, _new: self._show_hint())
        third: Any = {"sizing_mode": "stretch_width", "min_width": 50}
        self._step = Select(title="Snap to", options=STEPS, value="0.05", **third)
        self._percent = Spinner(title="Zone [%]", value=50, low=1, high=100, step=5, **third)
        self._speed = Spinner(title="Cart [m/s]", value=0.5, low=0.1, high=5, step=0.1, **third)
        self._entry = TextInput(
            title="Picked thing, as the file says it", visible=False, sizing_mode="stretch_width"
        )
        self._entry.on_change("value", self._edit)
        styled(self._files, self._name, self._description, self._robot, self._tool)
        styled(self._step, self._percent, self._speed, self._entry)
        self._hint = html()
        self._faults, self._text = html(name="faults"), html(name="text")
        self._hint.text = HINTS["Wall"]

    def _side(self) -> Column:
        save = Button(label="Save", button_type="primary", width=90, name="save")
        save.on_click(self._save)
        buttons = {
            "Undo": partial(self._step_back, again=False),
            "Redo": partial(self._step_back, again=True),
            "Delete": self._delete,
        }
        made = [
            Button(label=label, name=label.lower(), min_width=50, sizing_mode="stretch_width")
            for label in buttons
        ]
        for button, function in zip(made, buttons.values(), strict=True):
            button.on_click(function)
        return Column(
            self._files,
            self._tool,
            self._hint,
            Row(*styled(*made), spacing=2, sizing_mode="stretch_width"),
            Row(self._step, self._percent, self._speed, sizing_mode="stretch_width"),
            self._robot,
            self._description,
            self._name,
            styled(save),
            self._line,
            sizing_mode="stretch_width",
            spacing=8,
        )

    def _choices(self) -> list[tuple[str, str]]:
        folder = self._desk.folder
        return [
            CHOOSE,
            FLOOR,
            *((f"file:{name}", name) for name in files_of(folder, "scenario")),
            *((f"map:{name}", f"new: on {name}") for name in files_of(folder, "map")),
            *((f"world:{name}", f"new: in {name}") for name in folder.names(WORLD_SUFFIXES)),
            *((f"built-in:{name}", f"copy of {name}") for name in SCENARIO_FILES.names),
        ]

    def _let_pan(self) -> None:
        pan = self._plan.figure.select_one(PanTool)
        code = "pan.active = tool.labels[tool.active] === 'View'"
        self._tool.js_on_change(
            "active", CustomJS(args={"pan": pan, "tool": self._tool}, code=code)
        )

    # Opening and saving.

    def _choose(self, _name: str, _old: Any, chosen: str) -> None:
        kind, _, name = chosen.partition(":")
        if kind:
            self._try(partial(self._open, kind, name))
            self._files.update(options=self._choices(), value="")

    def _open(self, kind: str, name: str) -> None:
        scenario = self._desk.scenario
        if kind != "world":
            scenario.open(kind, name)
            self._opened()
            return
        scenario.require_saved(kind, name)
        path = self._desk.folder.inside(name)
        robot = self._desk.robot_argument()

        def take(content: dict[str, Any]) -> None:
            scenario.open_new(content, f"in_{path.stem}.yaml")
            self._opened()

        self._ask(
            lambda: self._desk.engine.look("scenario_of_world", path, robot),
            lambda content: self._try(partial(take, content)),
        )

    def _opened(self) -> None:
        scenario = self._desk.scenario
        self._picked, self._ground = None, None
        self._way_goes_on = False
        self._name.value = scenario.name
        self._refresh()
        self._plan.show_ground(None, None)
        self._plan.look_at(self._items(), None)
        asked = Asked(scenario.drawing.content, scenario.path)
        self._ask(
            lambda: self._desk.engine.look("open_scenario", asked),
            partial(self._grounded, scenario.opened),
        )

    def _grounded(self, opened: int, ground: Ground | None) -> None:
        if ground is None or opened != self._desk.scenario.opened:
            return
        self._ground = ground
        self._plan.show_ground(ground.image, ground.bounds)
        if ground.bounds is not None:
            # Without a map everything is in view, and the view must not move while the user draws.
            self._plan.look_at(self._items(), ground.bounds)

    def _save(self) -> None:
        def save() -> None:
            self._desk.scenario.save(self._name.value.strip())
            self._files.options = self._choices()
            self._say(f"{self._desk.scenario.name}: saved", "good")
            self._refresh()

        self._try(save)

    def _watch(self) -> None:
        """Shows the steps made on another page, and says if the file has changed on disk."""
        scenario = self._desk.scenario
        if self._seen != (scenario.opened, scenario.drawing.version):
            if self._seen is None or self._seen[0] != scenario.opened:
                self._opened()
            else:
                self._refresh()
        is_changed, was_changed = scenario.is_changed_on_disk, self._is_changed
        self._is_changed = is_changed
        if is_changed and not was_changed:
            # The line is shown once, so that it does not hide later lines.
            self._say(
                f"{scenario.name}: has changed on disk since it was opened; saving needs "
                "another name, opening it again takes what is there"
            )

    # Drawing.

    def _items(self) -> list[Item]:
        scenario = self._desk.scenario
        return items_of(scenario.drawing.content, scenario.floor)

    def _at(self, point: Place) -> Place:
        step_m = float(self._step.value)
        return snapped(point[0], step_m), snapped(point[1], step_m)

    def _hold(self) -> Hold:
        percent, speed_mps = int(self._percent.value or 50), float(self._speed.value or 0.5)
        picked = None if self._picked is None else self._picked.place
        name = TOOLS[self._tool.active]
        return Hold(name, self._desk.scenario.floor, percent, speed_mps, picked)

    def _drag(self, begin: Place, end: Place) -> None:
        tool = TOOLS[self._tool.active]
        if tool in OF_WAYS:
            # A short drag with a tool for ways is meant as a click.
            self._click(begin, False)
            return
        if tool == MOVE:
            self._picked = item_at(self._items(), begin)
        self._draw(self._at(begin), self._at(end))

    def _draw(self, one: drawing.Point, other: drawing.Point) -> None:
        content = self._desk.scenario.drawing.content
        self._try(lambda: self._apply(dragged(content, self._hold(), one, other)))

    def _click(self, point: Place, is_again: bool) -> None:
        tool, at = TOOLS[self._tool.active], self._at(point)
        if tool in OF_WAYS:
            if is_again and self._way_goes_on:
                self._way_goes_on = False
            else:
                self._try(partial(self._go_on, at))
        elif tool in OF_POSES:
            self._draw(at, at)
        elif tool == MOVE:
            self._picked = item_at(self._items(), point)
            self._refresh()

    def _go_on(self, point: drawing.Point) -> None:
        content = self._desk.scenario.drawing.content
        self._apply(with_way(content, self._hold(), point, goes_on=self._way_goes_on))
        self._way_goes_on = True

    def _delete(self) -> None:
        picked = self._picked
        if picked is None:
            self._say("Delete: pick a thing first, by a click with the tool Move")
            return
        self._picked = None
        content = self._desk.scenario.drawing.content
        self._try(lambda: self._apply(drawing.without(content, picked.place)))

    def _edit(self, _name: str, _old: str, text: str) -> None:
        picked, content = self._picked, self._desk.scenario.drawing.content
        if picked is None or text == _line_of(content, picked):
            return

        def edit() -> None:
            value = parse_yaml(f"picked: {text}", "Picked")["picked"]
            self._apply(with_entry(content, picked.place, value))

        self._try(edit)

    def _describe(self, _name: str, _old: str, text: str) -> None:
        content = self._desk.scenario.drawing.content
        if text != content.get("description"):
            self._try(lambda: self._apply(with_entry(content, ("description",), text)))

    def _choose_robot(self, _name: str, _old: str, robot: str) -> None:
        self._desk.robot = robot
        self._check()

    def _step_back(self, *, again: bool) -> None:
        self._picked = None
        self._way_goes_on = False
        (self._desk.scenario.drawing.redo if again else self._desk.scenario.drawing.undo)()
        self._refresh()

    def _apply(self, content: Mapping[str, Any]) -> None:
        self._desk.scenario.change(dict(content))
        self._refresh()

    # Showing.

    def _refresh(self) -> None:
        scenario = self._desk.scenario
        self._seen = (scenario.opened, scenario.drawing.version)
        items = self._items()
        if self._picked is not None:
            places = {item.place: item for item in items}
            self._picked = places.get(self._picked.place)
        self._plan.show(items, self._picked)
        picked = self._picked
        content = scenario.drawing.content
        self._entry.visible = picked is not None
        self._entry.value = "" if picked is None else _line_of(content, picked)
        self._description.value = str(content.get("description", ""))
        try:
            self._text.text = str(Markup("<pre>{}</pre>").format(scenario.saved_text()))
        except NavbenchError as error:
            self._text.text = str(lines([str(error)], "bad"))
        self._check()

    def _check(self) -> None:
        scenario = self._desk.scenario
        if not self._faults.text:
            self._faults.text = str(lines(["checking ..."], "soft"))
        try:
            asked = Asked(scenario.drawing.content, scenario.path)
            robot = self._desk.robot_argument()
        except NavbenchError as error:
            self._faults.text = str(lines([str(error)], "bad"))
            return
        self._ask(
            lambda: self._desk.engine.look("check_drawing", asked, robot),
            partial(self._checked, self._seen),
        )

    def _checked(self, seen: Any, found: Checked) -> None:
        if seen != self._seen:
            return
        shown = lines(found.faults, "bad") if found.faults else lines([FREE], "good")
        self._faults.text = str(shown)
        content = self._desk.scenario.drawing.content
        outlines = [
            (place_outline(found.outline, entry_at(content, item.place)), POSES[item.kind])
            for item in self._items()
            if item.kind in POSES and found.outline is not None
        ]
        self._plan.show_plans(found.plans, outlines)

    def _show_hint(self) -> None:
        self._way_goes_on = False
        self._hint.text = HINTS[TOOLS[self._tool.active]]


def _line_of(content: Any, picked: Item) -> str:
    """Returns a thing as YAML on one line."""
    value = entry_at(content, picked.place)
    text = yaml.safe_dump(value, default_flow_style=True, width=100_000, sort_keys=False)
    return text.strip()
