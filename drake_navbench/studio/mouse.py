"""The mouse on a figure: one message to the server for each click and each drag.

The page hears the browser's own pointer events. Bokeh's gestures are not used: two clicks at
different places within 300 ms are one double tap to them, and a button that is held longer makes
no tap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from bokeh.models import ColumnDataSource, CustomJS, Label, PanTool

from drake_navbench.studio import style

# A drag shorter than this is a click of an unsteady hand. A click within this distance of the last
# one is a second click on the same place, however late.
CLICK_PX, AGAIN_PX = 4.0, 8.0
LISTEN = style.asset("mouse.js")

Place = tuple[float, float]


class Mouse:
    """The mouse on a figure: its coordinates and the shape being drawn are shown beside it.

    tool, step: the widgets of the chosen tool and of the grid. shapes: tool -> the shape of its
    drag ('line', 'box' or 'circle'), shown while the button is down. A drag that pans the figure is
    not reported.
    """

    def __init__(self, figure: Any, tool: Any, step: Any, shapes: Mapping[str, str]) -> None:
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
        figure.add_layout(label)
        preview = ColumnDataSource({"x": [], "y": []})
        figure.line("x", "y", source=preview, color=style.PICKED, line_width=2.5)
        # The latest gesture; its count distinguishes it from an equal one before.
        self._gesture = ColumnDataSource(
            {name: [] for name in ("kind", "x0", "y0", "x1", "y1", "count")}
        )
        arguments = {
            "plot": figure,
            "pan": figure.select_one(PanTool),
            "tool": tool,
            "step": step,
            "label": label,
            "preview": preview,
            "gesture": self._gesture,
            "shapes": dict(shapes),
            "click_px": CLICK_PX,
            "again_px": AGAIN_PX,
        }
        # Runs as soon as the figure has its size.
        figure.js_on_change("inner_width", CustomJS(args=arguments, code=LISTEN))

    def on(
        self, on_drag: Callable[[Place, Place], None], on_click: Callable[[Place, bool], None]
    ) -> None:
        """Sets the functions that drags and clicks call.

        on_drag: gets both ends. on_click: gets the place, and whether the last click was at the
        same place; m, not snapped.
        """

        def on_gesture(_name: str, _old: Any, new: Mapping[str, Any]) -> None:
            kind, x0, y0, x1, y1 = (new[name][0] for name in ("kind", "x0", "y0", "x1", "y1"))
            if kind == "drag":
                on_drag((x0, y0), (x1, y1))
            else:
                on_click((x0, y0), kind == "again")

        self._gesture.on_change("data", on_gesture)
