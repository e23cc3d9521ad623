"""The page Scenario: draw a scenario, checked while it is drawn, and save it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from bokeh.document import Document
from bokeh.models import Button, Column, Row, Select, TextInput
from markupsafe import Markup

from drake_navbench.errors import NavbenchError
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.kernels.poses import place_outline
from drake_navbench.studio import drawing
from drake_navbench.studio.desk import Desk
from drake_navbench.studio.drawing import entry_at, with_entry
from drake_navbench.studio.drawing_tools import MOVE, OF_POSES, OF_WAYS, Hold, dragged, with_way
from drake_navbench.studio.floor_plan import POSES, FloorPlan
from drake_navbench.studio.messages import Checked, DrawnScenario, Ground
from drake_navbench.studio.mouse import Place
from drake_navbench.studio.open_scenario import WORLD_SUFFIXES, files_of
from drake_navbench.studio.page import Page
from drake_navbench.studio.scene_items import Item, item_at, items_of
from drake_navbench.studio.style import WIDE, fill, html, lines, styled
from drake_navbench.studio.tool_box import ToolBox
from drake_navbench.typed_files.typed_yaml import parse_yaml
from drake_navbench.typed_files.yaml_loader import dump_yaml

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
        self._tools = ToolBox(self._end_way)
        self._plan = FloorPlan(self._tools.buttons, self._tools.step, self._drag, self._click)
        self._tools.let_pan(self._plan.figure)
        self._make_widgets()
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
                **WIDE,
            ),
        )
        self._opened()
        document.add_periodic_callback(self._watch, REFRESH_MS)

    def _make_widgets(self) -> None:
        desk = self._desk
        self._files = Select(title="File", options=self._choices(), name="file", **WIDE)
        self._name = TextInput(title="Save as", name="save as", **WIDE)
        self._description = TextInput(title="Description", **WIDE)
        self._robot = Select(
            title="Robot, for the checks", options=desk.robots(), value=desk.robot, **WIDE
        )
        self._entry = TextInput(title="Picked thing, as the file says it", visible=False, **WIDE)
        self._files.on_change("value", self._choose)
        self._description.on_change("value", self._describe)
        self._robot.on_change("value", self._choose_robot)
        self._entry.on_change("value", self._edit)
        styled(self._files, self._name, self._description, self._robot, self._entry)
        self._faults, self._text = html(name="faults"), html(name="text")

    def _side(self) -> Column:
        save = Button(label="Save", button_type="primary", width=90, name="save")
        save.on_click(self._save)
        buttons = []
        for label, function in (
            ("Undo", partial(self._step_back, again=False)),
            ("Redo", partial(self._step_back, again=True)),
            ("Delete", self._delete),
        ):
            button = Button(label=label, name=label.lower(), min_width=50, **WIDE)
            button.on_click(function)
            buttons.append(button)
        return Column(
            self._files,
            self._tools.buttons,
            self._tools.hint,
            Row(*styled(*buttons), spacing=2, **WIDE),
            self._tools.settings,
            self._robot,
            self._description,
            self._name,
            styled(save),
            self._line,
            spacing=8,
            **WIDE,
        )

    def _choices(self) -> list[tuple[str, str]]:
        folder = self._desk.folder
        return [
            CHOOSE,
            FLOOR,
            *((f"file:{name}", name) for name in files_of(folder, "scenario")),
            *((f"way:{n}", f"new: {w['description']}") for n, w in self._desk.ways.items()),
            *((f"map:{name}", f"new: on {name}") for name in files_of(folder, "map")),
            *((f"world:{name}", f"new: in {name}") for name in folder.names(WORLD_SUFFIXES)),
            *((f"built-in:{name}", f"copy of {name}") for name in SCENARIO_FILES.names),
        ]

    # Opening and saving.

    def _choose(self, _name: str, _old: Any, chosen: str) -> None:
        kind, _, name = chosen.partition(":")
        if kind:
            self._try(partial(self._open, kind, name))
            self._files.update(options=self._choices(), value="")

    def _open(self, kind: str, name: str) -> None:
        scenario = self._desk.scenario
        if kind not in ("way", "world"):
            scenario.open(kind, name)
            self._opened()
            return
        scenario.require_saved(kind, name)
        if kind == "way":
            scenario.open_new(self._desk.ways[name], f"{name}.yaml")
            self._opened()
            return
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
        self._picked = None
        self._end_way()
        self._name.value = scenario.name
        self._refresh()
        self._plan.show_ground(None, None)
        self._plan.look_at(self._items(), None)
        drawn = DrawnScenario(scenario.drawing.content, scenario.path)
        self._ask(
            lambda: self._desk.engine.look("open_scenario", drawn),
            partial(self._grounded, scenario.opened),
        )

    def _grounded(self, opened: int, ground: Ground | None) -> None:
        if ground is None or opened != self._desk.scenario.opened:
            return
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

    @property
    def _content(self) -> Mapping[str, Any]:
        return self._desk.scenario.drawing.content

    def _hold(self) -> Hold:
        picked = None if self._picked is None else self._picked.place
        return self._tools.hold(self._desk.scenario.floor, picked)

    def _drag(self, begin: Place, end: Place) -> None:
        tool = self._tools.name
        if tool in OF_WAYS:
            # A short drag with a tool for ways is meant as a click.
            self._click(begin, False)
            return
        if tool == MOVE:
            self._picked = item_at(self._items(), begin)
        self._change(dragged, self._hold(), self._tools.snap(begin), self._tools.snap(end))

    def _click(self, point: Place, is_again: bool) -> None:
        tool, at = self._tools.name, self._tools.snap(point)
        if tool in OF_WAYS:
            if is_again and self._way_goes_on:
                self._end_way()
            elif self._change(partial(with_way, goes_on=self._way_goes_on), self._hold(), at):
                self._way_goes_on = True
        elif tool in OF_POSES:
            self._change(dragged, self._hold(), at, at)
        elif tool == MOVE:
            self._picked = item_at(self._items(), point)
            self._refresh()

    def _end_way(self) -> None:
        self._way_goes_on = False

    def _delete(self) -> None:
        picked = self._picked
        if picked is None:
            self._say("Delete: pick a thing first, by a click with the tool Move")
            return
        self._picked = None
        self._change(drawing.without, picked.place)

    def _edit(self, _name: str, _old: str, text: str) -> None:
        picked = self._picked
        if picked is None or text == _line_of(self._content, picked):
            return

        def edited(content: Mapping[str, Any]) -> Mapping[str, Any]:
            value = parse_yaml(f"picked: {text}", "Picked")["picked"]
            return with_entry(content, picked.place, value)

        self._change(edited)

    def _describe(self, _name: str, _old: str, text: str) -> None:
        if text != self._content.get("description"):
            self._change(with_entry, ("description",), text)

    def _choose_robot(self, _name: str, _old: str, robot: str) -> None:
        self._desk.robot = robot
        self._check()

    def _step_back(self, *, again: bool) -> None:
        self._picked = None
        self._end_way()
        drawn = self._desk.scenario.drawing
        (drawn.redo if again else drawn.undo)()
        self._refresh()

    def _change(self, function: Callable[..., Mapping[str, Any]], *arguments: Any) -> bool:
        """Has a function make the next content of the drawing; returns whether it did.

        function: is given the present content and the arguments, and may raise InputError.
        """

        def change() -> None:
            self._desk.scenario.change(dict(function(self._content, *arguments)))
            self._refresh()

        return self._try(change)

    # Showing.

    def _refresh(self) -> None:
        scenario = self._desk.scenario
        self._seen = (scenario.opened, scenario.drawing.version)
        items = self._items()
        if self._picked is not None:
            places = {item.place: item for item in items}
            self._picked = places.get(self._picked.place)
        picked, content = self._picked, self._content
        self._plan.show(items, picked)
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
            drawn = DrawnScenario(scenario.drawing.content, scenario.path)
            robot = self._desk.robot_argument()
        except NavbenchError as error:
            self._faults.text = str(lines([str(error)], "bad"))
            return
        self._ask(
            lambda: self._desk.engine.look("check_drawing", drawn, robot),
            partial(self._checked, self._seen),
        )

    def _checked(self, seen: Any, found: Checked) -> None:
        if seen != self._seen:
            return
        shown = lines(found.faults, "bad") if found.faults else lines([FREE], "good")
        self._faults.text = str(shown)
        content = self._content
        outlines = [
            (place_outline(found.outline, entry_at(content, item.place)), POSES[item.kind])
            for item in self._items()
            if item.kind in POSES and found.outline is not None
        ]
        self._plan.show_plans(found.plans, outlines)


def _line_of(content: Any, picked: Item) -> str:
    """Returns a thing as YAML on one line."""
    value = entry_at(content, picked.place)
    text = dump_yaml(value, default_flow_style=True, width=100_000, sort_keys=False)
    return text.strip()
