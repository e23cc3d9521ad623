"""Style of the figures: sizes, colours, line styles, and the files that are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

mpl.use("Agg")

from markupsafe import Markup
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.choice import AXES, PNG, SVG
from drake_navbench.typed_files.output_file import write_whole

SUFFIXES = (SVG, PNG)
POINTS_PER_INCH = 72
INK, MUTED, GRID = "#1f2933", "#6b7480", "#e3e7eb"
OBSTACLE_FACE, OBSTACLE_EDGE = "#c9ced4", "#6b7480"
MOVING_FACE, MOVING_COLOR = "#f0d9bf", "#b5752d"
PLAN_COLOR = "#1f2933"
# Line styles tell controllers apart in a black and white print, where colours do not.
LINE_STYLES = ("-", (0, (6, 2)), (0, (2, 1.4)), (0, (7, 2, 1.5, 2)), (0, (1, 1.2)))
X_LABEL_BELOW_IN, Y_LABEL_BESIDE_IN = 0.3, 0.5
# The room that a legend needs at its font size.
CHARACTER_IN, LEGEND_KEY_IN, LEGEND_LINE_IN = 0.075, 0.6, 0.2
# Few round numbers are easier to read, and drawing ticks takes longest.
MAX_TICK_STEPS = 5
SAVE_OPTIONS: Mapping[str, Any] = {
    ".svg": {"format": "svg", "metadata": {"Date": None}},
    ".png": {
        "format": "png",
        "dpi": 110,
        "metadata": {"Software": None},
        # Files are within a tenth as small as with level 6, in a third of the time.
        "pil_kwargs": {"compress_level": 3},
    },
}
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    # A fixed height; by default matplotlib measures every label to keep the title clear of it.
    "axes.titley": 1.0,
    "axes.titleweight": "bold",
    "figure.facecolor": "white",
    "font.size": 9,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "path.simplify_threshold": 0.3,
    "savefig.facecolor": "white",
    # Text stays text: small files that can be searched.
    "svg.fonttype": "none",
    "svg.hashsalt": "drake_navbench",
    "text.color": INK,
    # Names are users' texts: a '$' in them begins no formula.
    "text.parse_math": False,
    # Hinting shifts glyphs to whole pixels, which at this resolution costs more than it gives.
    "text.hinting": "none",
    # No tick marks: the grid shows where the ticks are.
    "xtick.bottom": False,
    "xtick.color": MUTED,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.color": MUTED,
    "ytick.left": False,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8,
}


class Look:
    """Colour, line style and marker of each controller of a campaign."""

    def __init__(self, controllers: Sequence[str], columns: Iterable[str] = ()) -> None:
        """columns: all columns of the results, among which each controller keeps its own colour."""
        self._beside = (*controllers, *columns)
        self._place = {name: place for place, name in enumerate(controllers)}

    def line(self, controller: str) -> dict[str, Any]:
        """Returns the keywords of a line."""
        return {
            "color": controller_color(controller, self._beside),
            "linestyle": LINE_STYLES[self._place[controller] % len(LINE_STYLES)],
        }

    def marker(self, controller: str) -> str:
        """Returns the marker."""
        return MARKERS[self._place[controller] % len(MARKERS)]

    def line_keys(self, controllers: Iterable[str]) -> list[Line2D]:
        """Returns the legend's entries for lines."""
        return [Line2D([], [], label=name, **self.line(name)) for name in controllers]

    def marker_keys(self, controllers: Iterable[str]) -> list[Line2D]:
        """Returns the legend's entries for markers."""
        keys: list[Line2D] = []
        for name in controllers:
            color = self.line(name)["color"]
            look: dict[str, Any] = {
                "color": color,
                "marker": self.marker(name),
                "ms": 7,
                "mec": "white",
            }
            keys.append(Line2D([], [], label=name, ls="none", **look))
        return keys


class Margins(NamedTuple):
    """Room around and between axes, inches."""

    left: float = 0.7
    right: float = 0.15
    bottom: float = 0.5
    top: float = 0.35
    between_columns: float = 0.75
    between_rows: float = 0.85


DEFAULT_MARGINS = Margins()


def new_figure(
    rows: int = 1,
    columns: int = 1,
    *,
    axes_size_in: tuple[float, float] = (6.4, 3.0),
    margins: Margins = DEFAULT_MARGINS,
) -> tuple[Figure, list[Axes]]:
    """Returns a figure and its axes row by row; call within `figure_style`.

    The room for labels is fixed: measuring every text, as matplotlib's layout engines do, would
    take longer than drawing.
    """
    width, height = axes_size_in
    inner_width = columns * width + (columns - 1) * margins.between_columns
    inner_height = rows * height + (rows - 1) * margins.between_rows
    full_width = inner_width + margins.left + margins.right
    full_height = inner_height + margins.bottom + margins.top
    figure = Figure(figsize=(full_width, full_height))
    grid = figure.subplots(
        rows,
        columns,
        squeeze=False,
        gridspec_kw={
            "left": margins.left / full_width,
            "right": 1.0 - margins.right / full_width,
            "bottom": margins.bottom / full_height,
            "top": 1.0 - margins.top / full_height,
            "wspace": margins.between_columns / width,
            "hspace": margins.between_rows / height,
        },
    )
    for axes in grid.flat:
        place_labels(axes)
        axes.locator_params(nbins=MAX_TICK_STEPS)
    return figure, list(grid.flat)


def place_labels(axes: Axes, *, is_right: bool = False) -> None:
    """Fixes where the axes' labels stand, as finding room for them takes long."""
    inches = axes.figure.dpi_scale_trans
    below = axes.transAxes + ScaledTranslation(0.0, -X_LABEL_BELOW_IN, inches)
    beside_in = Y_LABEL_BESIDE_IN if is_right else -Y_LABEL_BESIDE_IN
    beside = axes.transAxes + ScaledTranslation(beside_in, 0.0, inches)
    axes.xaxis.set_label_coords(0.5, 0.0, transform=below)
    axes.yaxis.set_label_coords(1.0 if is_right else 0.0, 0.5, transform=beside)


def name_axes(axes: Axes, kind: str) -> None:
    """Labels the axes of a kind of figure."""
    across, down = AXES[kind]
    axes.set_xlabel(across)
    axes.set_ylabel(down)


def clear_data(axes: Axes) -> None:
    """Removes all that was drawn, with the legend; axes, ticks, labels and titles stay."""
    for artist in [*axes.lines, *axes.collections, *axes.patches, *axes.texts]:
        artist.remove()
    legend = axes.get_legend()
    if legend is not None:
        legend.remove()
    axes.relim()
    axes.autoscale(enable=True)


def legend_below(figure: Figure, handles: Sequence[Artist]) -> None:
    """Adds a legend under the axes, making the figure taller by the lines that it needs."""
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = max(int(figure.get_figwidth() / (longest * CHARACTER_IN + LEGEND_KEY_IN)), 1)
    columns = min(columns, len(handles))
    room_in = LEGEND_LINE_IN * -(-len(handles) // columns) + LEGEND_LINE_IN
    old_in = figure.get_figheight()
    new_in = old_in + room_in
    for axes in figure.axes:
        box = axes.get_position(original=True)
        axes.set_position(
            (
                box.x0,
                (box.y0 * old_in + room_in) / new_in,
                box.width,
                box.height * old_in / new_in,
            )
        )
    figure.set_figheight(new_in)
    names = [str(handle.get_label()) for handle in handles]
    # matplotlib leaves out labels that begin with '_': each entry is made with '-' and named after.
    legend = figure.legend(handles, ["-"] * len(names), loc="lower center", ncols=columns)
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)


def legend_above(axes: Axes) -> None:
    """Adds a legend in the line of the title, at the right."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=4,
        borderaxespad=0.2,
        columnspacing=1.0,
        handlelength=1.8,
        handletextpad=0.5,
    )


def size_of(figure: Figure) -> tuple[int, int]:
    """Returns the width and the height of a figure, points."""
    width_in, height_in = figure.get_size_inches()
    return round(POINTS_PER_INCH * width_in), round(POINTS_PER_INCH * height_in)


def figure_style() -> AbstractContextManager[None]:
    """Returns the context in which figures are drawn and written."""
    return mpl.rc_context(STYLE)


def write_figure(figure: Figure, stem: Path, suffixes: Sequence[str] = SUFFIXES) -> list[Path]:
    """Writes a figure in these formats; equal figures give equal bytes. Returns the paths."""
    paths = [stem.with_name(stem.name + suffix) for suffix in suffixes]
    for path in paths:
        write_whole(path, partial(figure.savefig, **SAVE_OPTIONS[path.suffix]))
    return paths


def written_svg(figure: Figure, stem: Path) -> Markup:
    """Writes a figure as SVG, and returns its text for a page."""
    (path,) = write_figure(figure, stem, (SVG,))
    text = path.read_text(encoding="utf-8")
    # Safe: we made this SVG, and matplotlib has escaped the names in it.
    return Markup(text[text.index("<svg") :])
