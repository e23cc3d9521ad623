"""The picture of a scenario, drawn with the mouse: its things, the plan, the mouse's place."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.events import DoubleTap, MouseMove, Pan, PanEnd, PanStart, PressUp, Tap
from bokeh.models import ColumnDataSource, CustomJS, InlineStyleSheet, Label

from drake_navbench.studio import style
from drake_navbench.studio.scene_items import Item, bounds_of
from drake_navbench.studio.style import MapView, coordinates, image_at

# Tools whose drag is a line, a rectangle, a circle or an arrow; seen while the button is down.
SHAPES = {
    "Wall": "line",
    "Door": "line",
    "Box": "box",
    "Cylinder": "circle",
    "Keepout": "box",
    "Speed zone": "box",
    "Start": "line",
    "Goal": "line",
    "Waypoint": "line",
    "Move": "line",
}
COLORS = {
    "wall": style.WALL,
    "person": style.PEOPLE,
    "moving": style.PEOPLE,
    "keepout": style.KEEPOUT,
    "zone": style.SLOW,
}
AREAS = ("keepout", "zone")
POSES = {"start": style.START, "goal": style.GOAL}
MARGIN_M = 1.0
# A shorter drag is a click of a hand that is not still.
LEAST_DRAG_PX = 4.0
# Shows the mouse's place, and what a drag would draw; the server hears of the drag's end alone.
FOLLOW = """
const snap = (v) => step.value > 0 ? Math.round(v / step.value) * step.value : v;
const x = snap(cb_obj.x), y = snap(cb_obj.y);
let text = `${x.toFixed(2)}, ${y.toFixed(2)} m`;
if (cb_obj.event_name === "panstart") { state.data = {x: [x], y: [y]}; }
const from = state.data.x;
if (from.length && cb_obj.event_name !== "mousemove") {
  const x0 = from[0], y0 = state.data.y[0], kind = shapes[tool.labels[tool.active]];
  const dx = x - x0, dy = y - y0, length = Math.hypot(dx, dy);
  let xs = [x0, x], ys = [y0, y];
  if (kind === "box") { xs = [x0, x, x, x0, x0]; ys = [y0, y0, y, y, y0];
    text += `  ${Math.abs(dx).toFixed(2)} × ${Math.abs(dy).toFixed(2)} m`; }
  else { if (kind === "circle") { xs = []; ys = []; for (let i = 0; i <= 32; i++) {
      xs.push(x0 + length * Math.cos(i * Math.PI / 16));
      ys.push(y0 + length * Math.sin(i * Math.PI / 16)); } }
    text += `  ${length.toFixed(2)} m, ${(Math.atan2(dy, dx) * 180 / Math.PI).toFixed(0)}°`; }
  preview.data = {x: kind ? xs : [], y: kind ? ys : []};
}
if (cb_obj.event_name === "panend") { state.data = {x: [], y: []}; preview.data = {x: [], y: []}; }
label.x = cb_obj.x; label.y = cb_obj.y; label.text = text; label.visible = true;
"""


class FloorPlan:
    """A figure of a scenario.

    tool, step: the widgets of the chosen tool and of the grid. on_drag: is given both ends of a
    drag, on_tap the place of a click, on_double that of a double click; m, not snapped.
    """

    def __init__(self, tool: Any, step: Any) -> None:
        self._map = MapView(height=560, name="floor", active_drag=None)
        self.figure = self._map.figure
        self._begin: Any = None
        self._ground = ColumnDataSource(image_at(None, None))
        self._shapes = ColumnDataSource({"xs": [], "ys": [], "color": [], "alpha": [], "line": []})
        self._ways = ColumnDataSource({"xs": [], "ys": []})
        self._poses = ColumnDataSource({"x": [], "y": [], "color": []})
        self._arrows = ColumnDataSource({"xs": [], "ys": [], "color": []})
        self._outlines = ColumnDataSource({"xs": [], "ys": [], "color": []})
        self._plans = ColumnDataSource({"xs": [], "ys": []})
        self.preview = ColumnDataSource({"x": [], "y": []})
        self._draw()
        self._follow(tool, step)

    def _draw(self) -> None:
        plot = self.figure
        plot.image_rgba("image", "x", "y", "dw", "dh", source=self._ground)
        plot.patches(
            "xs",
            "ys",
            source=self._shapes,
            fill_color="color",
            fill_alpha="alpha",
            line_color="line",
            line_width=1.5,
        )
        plot.multi_line(
            "xs", "ys", source=self._ways, color=style.PEOPLE, line_dash="dotted", line_width=2
        )
        plot.multi_line(
            "xs", "ys", source=self._plans, color=style.PLAN, line_dash="dashed", line_width=2
        )
        plot.multi_line("xs", "ys", source=self._outlines, color="color", line_width=1.5)
        plot.multi_line("xs", "ys", source=self._arrows, color="color", line_width=3)
        plot.scatter("x", "y", source=self._poses, color="color", size=11)
        plot.line("x", "y", source=self.preview, color=style.PICKED, line_width=2.5)

    def _follow(self, tool: Any, step: Any) -> None:
        label = Label(
            x=0,
            y=0,
            x_offset=12,
            y_offset=10,
            text="",
            visible=False,
            text_color=style.INK,
            text_font_size="12px",
        )
        self.figure.add_layout(label)
        state = ColumnDataSource({"x": [], "y": []})
        follow = CustomJS(
            args={
                "tool": tool,
                "step": step,
                "state": state,
                "preview": self.preview,
                "label": label,
                "shapes": SHAPES,
            },
            code=FOLLOW,
        )
        for event in (MouseMove, PanStart, Pan, PanEnd):
            self.figure.js_on_event(event, follow)
        sheet = InlineStyleSheet(css=":host { cursor: crosshair; touch-action: none; }")
        self.figure.stylesheets = [*self.figure.stylesheets, sheet]

    def on_mouse(
        self,
        on_drag: Callable[[tuple[float, float], tuple[float, float]], None],
        on_tap: Callable[[tuple[float, float]], None],
        on_double: Callable[[tuple[float, float]], None],
    ) -> None:
        """Tells of drags, clicks and double clicks."""

        def begin(event: Any) -> None:
            self._begin = event

        def end(event: Any) -> None:
            start, self._begin = self._begin, None
            if start is None or self.figure.toolbar.active_drag is not None:
                return
            if math.hypot(event.sx - start.sx, event.sy - start.sy) < LEAST_DRAG_PX:
                on_tap((start.x, start.y))
            else:
                on_drag((start.x, start.y), (event.x, event.y))

        self.figure.on_event(PanStart, begin)
        self.figure.on_event(PanEnd, end)
        for click in (Tap, PressUp):
            # A button that is held for long makes a press.
            self.figure.on_event(click, lambda event: on_tap((event.x, event.y)))
        self.figure.on_event(DoubleTap, lambda event: on_double((event.x, event.y)))

    def show(self, items: Sequence[Item], picked: Item | None) -> None:
        """Draws the things of a scenario."""
        solid = [item for item in items if item.kind in COLORS]
        colors = [COLORS[item.kind] for item in solid]
        is_picked = [picked is not None and item.place == picked.place for item in solid]
        self._shapes.data = {
            **coordinates(item.outline for item in solid),
            "color": colors,
            "alpha": [0.25 if item.kind in AREAS else 0.75 for item in solid],
            "line": [
                style.PICKED if chosen else color
                for color, chosen in zip(colors, is_picked, strict=True)
            ],
        }
        self._ways.data = coordinates(item.way for item in items if len(item.way) > 1)
        poses = [item for item in items if item.kind in POSES]
        colors = [POSES[item.kind] for item in poses]
        arrows = coordinates(item.outline for item in poses)
        self._arrows.data = {**arrows, "color": colors}
        x, y = ([line[0] for line in arrows[name]] for name in ("xs", "ys"))
        self._poses.data = {"x": x, "y": y, "color": colors}

    def show_plans(self, plans: Sequence[Any], outlines: Sequence[tuple[Any, str]]) -> None:
        """Draws plans, and footprints in their colours; none where there are none."""
        self._plans.data = coordinates(plans)
        rings = coordinates(np.vstack([outline, outline[:1]]) for outline, _ in outlines)
        self._outlines.data = {**rings, "color": [color for _, color in outlines]}

    def show_ground(self, image: Any, bounds: tuple[float, float, float, float] | None) -> None:
        """Draws a map under everything; image: RGBA as (rows, columns) uint32; None: no map."""
        self._ground.data = image_at(image, bounds)

    def look_at(
        self, items: Sequence[Item], ground: tuple[float, float, float, float] | None
    ) -> None:
        """Has the whole scenario in view."""
        found = [bounds_of(items), *([ground] if ground else [])]
        low = [min(entry[axis] for entry in found) - MARGIN_M for axis in (0, 1)]
        high = [max(entry[axis] for entry in found) + MARGIN_M for axis in (2, 3)]
        self._map.look_at([*low, *high])
