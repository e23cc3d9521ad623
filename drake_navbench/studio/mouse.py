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
LISTEN = """
const view = Bokeh.index.find_one(plot), area = view.canvas_view.events_el;
if (area.is_heard) { return; }
area.is_heard = true;
const snap = (v) => step.value > 0 ? Math.round(v / step.value) * step.value : v;
// On the screen: the view may move under a hand that is still.
const px = (one, other) => Math.hypot(one.sx - other.sx, one.sy - other.sy);
const place = (event) => {
  const {x_scale, y_scale, bbox} = view.frame, box = area.getBoundingClientRect();
  const sx = event.clientX - box.x, sy = event.clientY - box.y;
  return {sx, sy, x: x_scale.invert(sx), y: y_scale.invert(sy), is_inside: bbox.contains(sx, sy)};
};
// Seen on this page alone: the server is not told.
const draw = (model, values) => model.setv(values, {sync: false});
let begin = null, last = null, count = 0;
const clear = () => { begin = null; draw(preview, {data: {x: [], y: []}}); };
const follow = (to) => {
  const x = snap(to.x), y = snap(to.y);
  let text = `${x.toFixed(2)}, ${y.toFixed(2)} m`;
  if (begin !== null) {
    const x0 = snap(begin.x), y0 = snap(begin.y), kind = shapes[tool.labels[tool.active]];
    const dx = x - x0, dy = y - y0, length = Math.hypot(dx, dy);
    let xs = [x0, x], ys = [y0, y];
    if (kind === "box") { xs = [x0, x, x, x0, x0]; ys = [y0, y0, y, y, y0];
      text += `  ${Math.abs(dx).toFixed(2)} × ${Math.abs(dy).toFixed(2)} m`; }
    else { if (kind === "circle") { xs = []; ys = []; for (let i = 0; i <= 32; i++) {
        xs.push(x0 + length * Math.cos(i * Math.PI / 16));
        ys.push(y0 + length * Math.sin(i * Math.PI / 16)); } }
      text += `  ${length.toFixed(2)} m, ${(Math.atan2(dy, dx) * 180 / Math.PI).toFixed(0)}°`; }
    draw(preview, {data: {x: kind ? xs : [], y: kind ? ys : []}});
  }
  draw(label, {x: to.x, y: to.y, text, visible: true});
};
const listeners = {
  pointerdown: (event) => {
    const at = place(event);
    if (event.isPrimary && event.button === 0 && !pan.active && at.is_inside) { begin = at; }
  },
  pointermove: (event) => { if (event.isPrimary) { follow(place(event)); } },
  pointerup: (event) => {
    if (begin === null || !event.isPrimary) { return; }
    const end = place(event), is_click = px(begin, end) < click_px;
    const is_again = is_click && last !== null && px(last, begin) < again_px;
    const kind = is_again ? "again" : is_click ? "click" : "drag";
    gesture.data = {kind: [kind], x0: [begin.x], y0: [begin.y], x1: [end.x], y1: [end.y],
      count: [++count]};
    last = is_click ? begin : null;
    clear();
    follow(end);
  },
  pointercancel: clear,
  pointerleave: () => { if (begin === null) { draw(label, {visible: false}); } },
};
for (const [name, listener] of Object.entries(listeners)) { area.addEventListener(name, listener); }
"""

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
