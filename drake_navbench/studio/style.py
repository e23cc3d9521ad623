"""The look of a studio's pages: template, colours for light and dark, and small pieces of HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.resources import files
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


def asset(name: str) -> str:
    """Returns the text of a file beside this module: HTML, a style sheet or a script."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


PAGE = Template(asset("page.html"))

WIDGETS, HTML = asset("widgets.css"), asset("texts.css")
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
FIT = asset("fit.js")


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
