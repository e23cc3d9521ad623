"""The picture of a scenario, drawn with the mouse: its things, the plan, the mouse's place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, InlineStyleSheet

from drake_navbench.studio import style
from drake_navbench.studio.mouse import Mouse, Place
from drake_navbench.studio.scene_items import Item, bounds_of
from drake_navbench.studio.style import MapView, coordinates, image_at

# The tools whose drag is shown as a line, a rectangle, a circle or an arrow while the button is
# down.
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


class FloorPlan:
    """A figure of a scenario.

    tool, step: the widgets of the chosen tool and of the grid. on_drag, on_click: see `Mouse`.
    """

    def __init__(
        self,
        tool: Any,
        step: Any,
        on_drag: Callable[[Place, Place], None],
        on_click: Callable[[Place, bool], None],
    ) -> None:
        self._map = MapView(height=560, name="floor", active_drag=None)
        self.figure = self._map.figure
        self._ground = ColumnDataSource(image_at(None, None))
        self._shapes = ColumnDataSource({"xs": [], "ys": [], "color": [], "alpha": [], "line": []})
        self._ways = ColumnDataSource({"xs": [], "ys": []})
        self._poses = ColumnDataSource({"x": [], "y": [], "color": []})
        self._arrows = ColumnDataSource({"xs": [], "ys": [], "color": []})
        self._outlines = ColumnDataSource({"xs": [], "ys": [], "color": []})
        self._plans = ColumnDataSource({"xs": [], "ys": []})
        self._draw()
        sheet = InlineStyleSheet(css=":host { cursor: crosshair; touch-action: none; }")
        self.figure.stylesheets = [*self.figure.stylesheets, sheet]
        Mouse(self.figure, tool, step, SHAPES).on(on_drag, on_click)

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
        """Draws plans, and footprints in their colours, in place of those drawn before."""
        self._plans.data = coordinates(plans)
        rings = coordinates(np.vstack([outline, outline[:1]]) for outline, _ in outlines)
        self._outlines.data = {**rings, "color": [color for _, color in outlines]}

    def show_ground(self, image: Any, bounds: tuple[float, float, float, float] | None) -> None:
        """Draws a map under everything; image: RGBA as (rows, columns) uint32; None: no map."""
        self._ground.data = image_at(image, bounds)

    def look_at(
        self, items: Sequence[Item], ground: tuple[float, float, float, float] | None
    ) -> None:
        """Moves the view so that it shows the whole scenario."""
        found = [bounds_of(items), *([ground] if ground else [])]
        low = [min(entry[axis] for entry in found) - MARGIN_M for axis in (0, 1)]
        high = [max(entry[axis] for entry in found) + MARGIN_M for axis in (2, 3)]
        self._map.look_at([*low, *high])
