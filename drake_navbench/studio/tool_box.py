"""The drawing tools of the page Scenario: the buttons, the hint of the selected one, settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.models import CustomJS, InlineStyleSheet, PanTool, RadioButtonGroup, Row, Select, Spinner

from drake_navbench.studio.drawing import Place, Point, snapped
from drake_navbench.studio.drawing_tools import HINTS, LOOK, TOOLS, Hold
from drake_navbench.studio.style import WIDE, html, styled

STEPS = [("0", "nothing"), ("0.01", "1 cm"), ("0.05", "5 cm"), ("0.1", "10 cm"), ("0.5", "50 cm")]
GRID = (
    ".bk-btn-group { display: grid !important; gap: 4px; "
    "grid-template-columns: repeat(auto-fill, minmax(84px, 1fr)); }"
)
FIRST = "Wall"


class ToolBox:
    """The widgets of the drawing tools.

    buttons, step: the widgets of the selected tool and of the grid. hint, settings: what stands
    below them. on_select: is called when another tool is selected.
    """

    def __init__(self, on_select: Callable[[], None]) -> None:
        self._on_select = on_select
        first = TOOLS.index(FIRST)
        self.buttons = RadioButtonGroup(name="tool", labels=TOOLS, active=first, **WIDE)
        self.buttons.stylesheets = [InlineStyleSheet(css=GRID)]
        self.buttons.on_change("active", lambda _name, _old, _new: self._selected())
        third = WIDE | {"min_width": 50}
        self.step = Select(title="Snap to", options=STEPS, value="0.05", **third)
        self._percent = Spinner(title="Zone [%]", value=50, low=1, high=100, step=5, **third)
        self._speed = Spinner(title="Cart [m/s]", value=0.5, low=0.1, high=5, step=0.1, **third)
        styled(self.buttons, self.step, self._percent, self._speed)
        self.hint = html(HINTS[FIRST])
        self.settings = Row(self.step, self._percent, self._speed, **WIDE)

    @property
    def name(self) -> str:
        """The selected tool, of TOOLS."""
        return TOOLS[self.buttons.active]

    def hold(self, floor: Place, picked: Place | None) -> Hold:
        """Returns the selected tool with its settings; floor, picked: see `Hold`."""
        percent, speed_mps = int(self._percent.value or 50), float(self._speed.value or 0.5)
        return Hold(self.name, floor, percent, speed_mps, picked)

    def snap(self, point: Point) -> Point:
        """Returns the point of the grid nearest to a point, m."""
        step_m = float(self.step.value)
        return snapped(point[0], step_m), snapped(point[1], step_m)

    def let_pan(self, figure: Any) -> None:
        """Has a drag move the view of a figure while the tool View is selected."""
        pan = figure.select_one(PanTool)
        code = f"pan.active = tool.labels[tool.active] === '{LOOK}'"
        self.buttons.js_on_change(
            "active", CustomJS(args={"pan": pan, "tool": self.buttons}, code=code)
        )

    def _selected(self) -> None:
        self.hint.text = HINTS[self.name]
        self._on_select()
