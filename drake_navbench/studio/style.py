"""The look of a studio's pages: template, colours for light and dark, and small pieces of HTML."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import ColumnDataSource, CustomJS, Div, InlineStyleSheet, Range1d, UIElement
from bokeh.plotting import figure
from jinja2 import Template
from markupsafe import Markup, escape

# These colours are visible on light and dark ground, so pictures need no theme.
INK, FAINT, FAINT_LINE = "#7d8793", "rgba(125, 135, 147, 0.22)", "rgba(125, 135, 147, 0.6)"
WALL, START, GOAL, PLAN = "#64707d", "#2a9d5c", "#d9582b", "#3d7ee0"
PEOPLE, KEEPOUT, SLOW, PICKED = "#a15ec0", "#d64550", "#d9a21b", "#3d7ee0"
NOW, BEFORE, REFERENCE = "#3d7ee0", "#d98a2b", "#2a9d5c"
TASKS = (("runs", "Runs"), ("scenario", "Scenario"), ("drive", "Drive"), ("live", "Live"))
# How elements take the width of the column that they stand in.
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}

PAGE = Template("""\
{% extends base %}
{% block preamble %}
<meta name="viewport" content="width=device-width">
<meta name="referrer" content="no-referrer">
<link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark; --ground: #f5f6f8; --card: #ffffff; --ink: #1d242c;
  --soft: #5b6672; --line: #dde2e8; --accent: #2f6fd6; --field: #ffffff; --good: #1f7f49;
  --bad: #b8321f; --tint: rgba(47, 111, 214, 0.1); }
@media (prefers-color-scheme: dark) { :root { --ground: #12161b; --card: #1b2027; --ink: #e4e9ef;
  --soft: #98a4b1; --line: #2d353f; --accent: #6ea2f5; --field: #12161b; --good: #5cc98d;
  --bad: #f08a76; --tint: rgba(110, 162, 245, 0.15); } }
/* Always: one that appears would move the picture under a hand that draws. */
html { overflow-y: scroll; }
body { background: var(--ground); color: var(--ink);
  font: 14px/1.45 Helvetica, Arial, sans-serif; }
header { display: flex; align-items: center; gap: 6px; padding: 0 20px; height: 50px;
  background: var(--card); border-bottom: 1px solid var(--line); position: sticky; top: 0;
  z-index: 5; }
header b { font-size: 15px; margin-right: 14px; letter-spacing: 0.01em; }
header a { color: var(--soft); text-decoration: none; padding: 6px 12px; border-radius: 7px; }
header a:hover { background: var(--tint); }
header a.here { color: var(--accent); background: var(--tint); font-weight: 600; }
header span { margin-left: auto; color: var(--soft); overflow: hidden; text-overflow: ellipsis;
  white-space: nowrap; max-width: 40%; direction: rtl; }
.sheet { display: grid; grid-template-columns: 320px minmax(0, 1fr); gap: 16px; padding: 16px 20px;
  max-width: 1500px; margin: 0 auto; align-items: start; }
.sheet.one { grid-template-columns: minmax(0, 1fr); max-width: 1000px; }
.sheet > div { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: 14px; min-width: 0; box-sizing: border-box; }
.sheet.one > div { background: none; border: none; padding: 0; }
@media (max-width: 900px) { .sheet { grid-template-columns: 250px minmax(0, 1fr); gap: 10px;
  padding: 10px; } .sheet > div { padding: 8px; } header { padding: 0 12px; } }
@media (max-width: 640px) { .sheet { grid-template-columns: minmax(0, 1fr); }
  header span { display: none; } }
</style>
{% endblock %}
{% block contents %}
<header><b>studio</b>
{% for name, title in tasks %}<a href="{{ name }}"{% if name == page %} class="here"{% endif %}\
>{{ title }}</a>{% endfor %}
<span title="{{ folder }}">&lrm;{{ folder }}</span></header>
<div class="sheet{% if not has_side %} one{% endif %}">
{% if has_side %}<div class="side">{{ embed(roots.side) }}</div>{% endif %}
<div class="main">{{ embed(roots.main) }}</div></div>
{% endblock %}
""")

WIDGETS = """\
:host { color: var(--ink); font: 13px/1.4 Helvetica, Arial, sans-serif; }
.bk-input, select.bk-input, input[type=text] { background: var(--field); color: var(--ink);
  border: 1px solid var(--line); border-radius: 7px; }
/* Arrows in the colour of the text: Bokeh's are black, on dark ground, too. */
select.bk-input.bk-input { padding-right: 22px; background: linear-gradient(45deg,
  transparent 50%, var(--soft) 50%) calc(100% - 13px) 50% / 5px 5px no-repeat,
  linear-gradient(-45deg, transparent 50%, var(--soft) 50%) calc(100% - 8px) 50% / 5px 5px
  no-repeat, var(--field); }
select.bk-input option { background: var(--field); color: var(--ink); }
.bk-spin-wrapper { --color: var(--soft); }
.bk-input:focus { border-color: var(--accent); box-shadow: 0 0 0 2px var(--tint); }
.bk-input-group label, label, .bk-slider-title { color: var(--soft); font-size: 12px; }
.bk-btn, .bk-btn-default { background: var(--card); color: var(--ink); border: 1px solid
  var(--line); border-radius: 7px !important; font: inherit; font-weight: 500; }
.bk-btn:hover { background: var(--tint); border-color: var(--accent); }
.bk-btn.bk-active { background: var(--tint); color: var(--accent); border-color: var(--accent);
  box-shadow: none; }
.bk-btn-primary { background: var(--accent); border-color: var(--accent); color: #fff; }
.bk-btn-primary:hover { background: var(--accent); filter: brightness(1.1); }
:host { color-scheme: light dark; }
.bk-btn[disabled] { opacity: 0.45; background: var(--card); color: var(--soft); }
.noUi-target { background: var(--line); border: none; box-shadow: none; }
.noUi-connect, .noUi-connects .noUi-connect { background: var(--accent); }
.noUi-handle { border: 1px solid var(--soft); background: var(--card); box-shadow: none; }
"""
HTML = """\
:host { color: var(--ink); font: 13px/1.45 Helvetica, Arial, sans-serif; }
.bk-clearfix { width: 100%; }
h2 { font-size: 15px; margin: 0 0 4px; } h3 { font-size: 13px; margin: 0 0 4px; }
p { margin: 0 0 4px; }
b { overflow-wrap: anywhere; } .soft { color: var(--soft); } .good { color: var(--good); }
.bad { color: var(--bad); } a { color: var(--accent); text-decoration: none; margin-right: 14px; }
a:hover { text-decoration: underline; }
.tag { background: var(--tint); color: var(--accent); border-radius: 9px; padding: 1px 8px;
  margin-left: 6px; font-size: 11px; }
.bar { height: 5px; border-radius: 3px; background: var(--line); margin: 6px 0; }
.bar i { display: block; height: 100%; border-radius: 3px; background: var(--accent); }
pre { margin: 0; font: 12px/1.5 ui-monospace, monospace; white-space: pre-wrap;
  overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; } td, th { text-align: right; padding: 3px 6px;
  border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
td:first-child, th:first-child { text-align: left; padding-left: 0; } .word { text-align: left; }
.key { border-radius: 3px; display: inline-block; height: 4px; margin: 0 5px 2px 0; width: 22px; }
th { vertical-align: bottom; font-weight: 500;
  color: var(--soft); }
"""
CARD = """\
:host { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: 12px 14px; box-sizing: border-box; }
"""
BAR = ":host { --surface-background-color: transparent; } .bk-tool-icon { opacity: 0.8; }"


def styled(*elements: Any) -> Any:
    """Gives widgets the studio's look; returns the only one, or all."""
    for element in elements:
        element.stylesheets = [*element.stylesheets, InlineStyleSheet(css=WIDGETS)]
    return elements[0] if len(elements) == 1 else list(elements)


def html(text: str | Markup = "", **properties: Any) -> Div:
    """Returns a piece of HTML; text that is no Markup is shown as it is, whatever it says."""
    sheets = [InlineStyleSheet(css=HTML), *properties.pop("stylesheets", [])]
    return Div(
        text=str(escape(text)), stylesheets=sheets, sizing_mode="stretch_width", **properties
    )


def card(**properties: Any) -> Div:
    """Returns a piece of HTML on a ground of its own."""
    return html(stylesheets=[InlineStyleSheet(css=CARD)], **properties)


def lines(texts: Iterable[str], kind: str = "") -> Markup:
    """Returns lines of text as paragraphs, of a kind such as 'bad'."""
    return Markup("").join(Markup('<p class="{}">{}</p>').format(kind, text) for text in texts)


def table(head: Sequence[str], rows: Sequence[Sequence[str | Markup]]) -> Markup:
    """Returns a table of texts; a column with sentences is flush left, one of numbers right."""
    long = {index for row in rows for index, text in enumerate(row) if len(text.split()) > 3}
    kinds = ["word" if index in long else "" for index in range(len(head))]

    def line(tag: str, row: Sequence[str | Markup]) -> Markup:
        cell = Markup('<{0} class="{1}">{2}</{0}>')
        cells = (cell.format(tag, kind, text) for kind, text in zip(kinds, row, strict=True))
        return Markup("<tr>{}</tr>").format(Markup("").join(cells))

    body = Markup("").join(line("td", row) for row in rows)
    return Markup("<table>{}{}</table>").format(line("th", head), body)


def key(entries: Iterable[tuple[str, str]]) -> Markup:
    """Returns the key of a picture's lines, of colour and meaning each."""
    entry = Markup('<i class="key" style="background: {}"></i>{}')
    return Markup(" &emsp; ").join(entry.format(*one) for one in entries)


def picture(**properties: Any) -> Any:
    """Returns a figure on the page's own ground, with axes that are seen on light and dark."""
    plot = figure(
        **(
            {
                "sizing_mode": "stretch_width",
                "toolbar_location": "right",
                "background_fill_alpha": 0.0,
                "border_fill_alpha": 0.0,
                "outline_line_color": None,
                "min_border": 4,
                "output_backend": "canvas",
            }
            | properties
        )
    )
    for axis in (*plot.xaxis, *plot.yaxis):
        axis.update(
            axis_line_color=None,
            major_tick_line_color=None,
            minor_tick_line_color=None,
            major_label_text_color=INK,
            axis_label_text_color=INK,
            axis_label_text_font_style="normal",
            axis_label_text_font_size="12px",
        )
    for grid in (*plot.xgrid, *plot.ygrid):
        grid.grid_line_color = FAINT
    plot.toolbar.logo = None
    plot.toolbar.stylesheets = [InlineStyleSheet(css=BAR)]
    return plot


def fill(document: Document, page: str, folder: str, *, main: UIElement, side: Any = None) -> None:
    """Puts a page together."""
    document.title = f"{page} · studio"
    document.template = PAGE
    document.template_variables.update(
        {"tasks": TASKS, "page": page, "folder": folder, "has_side": side is not None}
    )
    for name, root in (("side", side), ("main", main)):
        if root is not None:
            root.name = name
            document.add_root(root)


def every(document: Document, milliseconds: int, function: Callable[[], None]) -> None:
    """Calls a function again and again while the page is open."""
    document.add_periodic_callback(function, milliseconds)


def coordinates(lines: Iterable[Any]) -> dict[str, list[Any]]:
    """Returns lines or rings, (N, 2) m each, as the columns xs and ys of a picture's source."""
    drawn = [np.asarray(line, dtype=float).reshape(-1, 2) for line in lines]
    xs, ys = ([line[:, axis].tolist() for line in drawn] for axis in (0, 1))
    return {"xs": xs, "ys": ys}


def image_at(image: Any, bounds: Sequence[float] | None) -> dict[str, list[Any]]:
    """Returns an RGBA image over x0, y0, x1, y1 m as columns of a source; None: nothing."""
    if bounds is None:
        return {"image": [], "x": [], "y": [], "dw": [], "dh": []}
    x0, y0, x1, y1 = map(float, bounds)
    return {"image": [image], "x": [x0], "y": [y0], "dw": [x1 - x0], "dh": [y1 - y0]}


# One metre is as long in both directions, whatever the picture's size.
FIT = """
const [x0, y0, x1, y1] = view.data.bounds, w = plot.inner_width, h = plot.inner_height;
if (w > 0 && h > 0) {
  const metre = Math.max((x1 - x0) / w, (y1 - y0) / h), x = (x0 + x1) / 2, y = (y0 + y1) / 2;
  plot.x_range.setv({start: x - metre * w / 2, end: x + metre * w / 2,
    reset_start: x - metre * w / 2, reset_end: x + metre * w / 2});
  plot.y_range.setv({start: y - metre * h / 2, end: y + metre * h / 2,
    reset_start: y - metre * h / 2, reset_end: y + metre * h / 2});
}
"""


class MapView:
    """A figure in metres, with the same scale in both directions, and the area that is in view."""

    def __init__(self, **properties: Any) -> None:
        self.figure = picture(
            x_range=Range1d(-1.0, 1.0),
            y_range=Range1d(-1.0, 1.0),
            x_axis_label="x [m]",
            y_axis_label="y [m]",
            tools="pan,wheel_zoom,reset",
            active_scroll="wheel_zoom",
            **properties,
        )
        self._view = ColumnDataSource({"bounds": [-1.0, -1.0, 1.0, 1.0]})
        fit = CustomJS(args={"plot": self.figure, "view": self._view}, code=FIT)
        self._view.js_on_change("data", fit)
        for size in ("inner_width", "inner_height"):
            self.figure.js_on_change(size, fit)

    def look_at(self, bounds: Sequence[float]) -> None:
        """Moves the view to the area min_x, min_y, max_x, max_y m."""
        self._view.data = {"bounds": list(map(float, bounds))}
