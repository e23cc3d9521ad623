"""Pictures of a task before anything drives: a scene, a robot, and its reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from drake_navbench.analysis.cost_colors import palette, palette_rows
from drake_navbench.analysis.figures.course import (
    MARGIN_M,
    MAX_HEIGHT_IN,
    MIN_HEIGHT_IN,
    WIDTH_IN,
    Course,
    draw_course,
    draw_outlines,
)
from drake_navbench.analysis.figures.style import (
    INK,
    OBSTACLE_EDGE,
    Margins,
    legend_below,
    new_figure,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import INSCRIBED, LETHAL, Grid
from drake_navbench.kernels.poses import place_outline

# Okabe and Ito's colours, which everybody can tell apart.
START, GOAL = "#0072B2", "#D55E00"
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
DASHES = ("-", (0, (6, 2)), (0, (2, 1.4)), (0, (7, 2, 1.5, 2)))
HATCHES = ("////", "....", "xxxx", "++++")
MASKS = ("#CC79A7", "#56B4E9", "#009E73")
# The scale's bar is about this share of the picture's width.
BAR_SHARE = 0.2
PANEL_IN = 3.4
# An area that reaches this many times as far as the panel would cover all of it: it is left white.
WHOLE_RATIO = 1.5
# The near view's reach over the robot's own size.
NEAR_RATIO = 1.35


class Task(NamedTuple):
    """A start and a goal, (3,) x m, y m, yaw rad; plan: (N, 3), or None without a plan."""

    start: Array
    goal: Array
    plan: Array | None


class SceneView(NamedTuple):
    """A scene before anything drives.

    course: as in the maps of driven paths. others: outlines by their legend's text, such as
    obstacles that are on no map. costs: grids of costmaps. known: x0, y0, x1, y1 m of the area that
    each map shows, (4,). masks: filters' grids by their legend's text; every value above 0 is
    drawn. outline: (K, 2) of the robot in its own frame.
    """

    title: str
    course: Course
    others: dict[str, list[Array]]
    costs: list[Grid]
    known: list[Array]
    masks: dict[str, list[Grid]]
    tasks: list[Task]
    outline: Array


class Shape(NamedTuple):
    """A line around the robot, (K, 2) m in its frame, with its name and numbers.

    is_open: whether its last corner is not joined to the first.
    """

    label: str
    corners: Array
    is_filled: bool = False
    is_open: bool = False


class AroundView(NamedTuple):
    """A robot from above with the areas that it reaches; x ahead, y to the left, m.

    shapes: in any order. graded: radii, m, and the cost, 0 to 254, that an obstacle at this
    distance gives the robot's centre. near_m: half of the width of the panel that shows what is
    near; 0 for one panel alone.
    """

    title: str
    outline: Array
    shapes: list[Shape]
    graded: list[tuple[float, int]]
    near_m: float


def scene_figure(view: SceneView) -> Figure:
    """Returns the picture of a scene; call within `figure_style`."""
    low, high = _bounds(view)
    height_in = WIDTH_IN * (high[1] - low[1]) / (high[0] - low[0])
    height_in = float(np.clip(height_in, MIN_HEIGHT_IN, MAX_HEIGHT_IN))
    figure, (axes,) = new_figure(axes_size_in=(WIDTH_IN, height_in))
    keys: list[Any] = [_draw_grid(axes, grid) for grid in view.costs][:1]
    # By the alphabet: a mask's colour depends only on the kinds of masks in the picture.
    for (name, grids), color in zip(sorted(view.masks.items()), MASKS * 9, strict=False):
        key, *_ = [_draw_mask(axes, name, grid, color) for grid in grids]
        keys.append(key)
    draw_course(axes, view.course)
    for (label, outlines), hatch in zip(view.others.items(), HATCHES, strict=False):
        look: dict[str, Any] = {"facecolor": "none", "edgecolor": OBSTACLE_EDGE, "hatch": hatch}
        axes.add_collection(PolyCollection(outlines, **look, linewidth=0.8), autolim=False)
        keys.append(Patch(label=label, **look))
    for number, task in enumerate(view.tasks, start=1):
        _draw_task(axes, view, task, str(number) if len(view.tasks) > 1 else "")
    keys += [
        Line2D([], [], color=START, lw=1.6, label="robot at the start, tick ahead"),
        Line2D([], [], color=GOAL, lw=1.6, ls=(0, (3, 1)), label="robot at the goal"),
    ]
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_title(view.title)
    _draw_scale(axes)
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, [*handles, *[key for key in keys if key is not None]])
    return figure


def around_figure(view: AroundView) -> Figure:
    """Returns the picture of a robot and its surroundings; call within `figure_style`."""
    reach_m = max(float(np.abs(s.corners).max()) for s in (*view.shapes, _own(view)))
    halves = [view.near_m, reach_m] if 0.0 < view.near_m < 0.8 * reach_m else [reach_m]
    single = (1.6 * PANEL_IN, 1.6 * PANEL_IN)
    figure, panels = new_figure(
        1,
        len(halves),
        axes_size_in=(PANEL_IN, PANEL_IN) if len(halves) > 1 else single,
        margins=Margins(between_columns=0.65),
    )
    looks: list[dict[str, Any]] = [
        {"color": color, "ls": DASHES[index // len(LINES) % len(DASHES)], "lw": 1.5}
        for index, color in enumerate((LINES * 9)[: len(view.shapes)])
    ]
    for axes, half in zip(panels, halves, strict=True):
        half *= 1.08
        _draw_rings(axes, view.graded, 1.5 * half)
        for shape, look in zip(view.shapes, looks, strict=True):
            is_seen = float(np.abs(shape.corners).max()) <= WHOLE_RATIO * half
            if shape.is_filled and is_seen:
                axes.fill(*shape.corners.T, color=look["color"], alpha=0.12, lw=0)
            line = shape.corners if shape.is_open else _closed(shape.corners)
            axes.plot(*line.T, **look)
        draw_outlines(axes, [view.outline], INK)
        axes.fill(*view.outline.T, color=INK, alpha=0.15, lw=0)
        ahead = float(view.outline[:, 0].max())
        axes.plot([0.0, ahead], [0.0, 0.0], color=INK, lw=1.2)
        axes.set_xlim(-half, half)
        axes.set_ylim(-half, half)
        axes.set_aspect("equal")
        axes.set_xlabel("ahead: x [m]")
        _draw_scale(axes)
    panels[0].set_ylabel("left: y [m]")
    panels[0].set_title(view.title)
    keys: list[Any] = [Line2D([], [], color=INK, lw=1.2, label="robot, tick ahead")]
    keys += [Line2D([], [], label=s.label, **k) for s, k in zip(view.shapes, looks, strict=True)]
    if view.graded:
        keys.append(Patch(color=_rgba(128), label="cost of an obstacle at that distance"))
    legend_below(figure, keys)
    return figure


def _own(view: AroundView) -> Shape:
    return Shape("", NEAR_RATIO * view.outline)


def _closed(corners: Array) -> Array:
    return np.vstack([corners, corners[:1]])


def _bounds(view: SceneView) -> tuple[Array, Array]:
    """Returns the lower left and the upper right corner of all that is drawn, with a margin, m."""
    course = view.course
    parts = [pose[None, :2] for task in view.tasks for pose in (task.start, task.goal)]
    parts += [*course.obstacles, *course.plans, *course.movers, *course.ways]
    parts += [corners for outlines in view.others.values() for corners in outlines]
    if len(course.waypoints):
        parts.append(course.waypoints)
    parts += [np.reshape(known, (2, 2)) for known in view.known]
    margin_m = float(np.hypot(*view.outline.T).max()) + MARGIN_M
    points = np.vstack(parts)
    return np.nanmin(points, axis=0) - margin_m, np.nanmax(points, axis=0) + margin_m


def _draw_grid(axes: Axes, grid: Grid) -> Patch:
    """Draws a costmap below everything else; returns its legend's key."""
    costs, x, y, resolution = grid
    rows, columns = costs.shape
    image = palette()[palette_rows()[costs]]
    extent = (x, x + columns * resolution, y, y + rows * resolution)
    axes.imshow(image, extent=extent, origin="lower", interpolation="none", zorder=0.5)
    return Patch(color=_rgba(128), label="costmap: costs, darkest where occupied")


def _draw_mask(axes: Axes, name: str, grid: Grid, color: str) -> Patch:
    """Draws the cells of a filter's mask that are not 0; returns its legend's key."""
    values, x, y, resolution = grid
    rows, columns = values.shape
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    image = np.zeros((rows, columns, 4), dtype=np.uint8)
    image[values > 0] = (red, green, blue, 90)
    extent = (x, x + columns * resolution, y, y + rows * resolution)
    axes.imshow(image, extent=extent, origin="lower", interpolation="none", zorder=0.6)
    return Patch(color=color, alpha=90 / 255, label=name)


def _draw_task(axes: Axes, view: SceneView, task: Task, number: str) -> None:
    for pose, color, style in ((task.start, START, "-"), (task.goal, GOAL, (0, (3, 1)))):
        corners = place_outline(view.outline, pose)
        axes.fill(*corners.T, facecolor=color, alpha=0.18, lw=0, zorder=2.4)
        axes.plot(*_closed(corners).T, color=color, ls=style, lw=1.4, zorder=2.5)
        ahead = float(view.outline[:, 0].max())
        tip = pose[:2] + ahead * np.array([math.cos(pose[2]), math.sin(pose[2])])
        axes.plot(*np.array([pose[:2], tip]).T, color=color, lw=1.4, zorder=2.5)
        if number:
            axes.annotate(
                number,
                tuple(pose[:2]),
                fontsize=7,
                color=color,
                weight="bold",
                xytext=(4, 4),
                textcoords="offset points",
            )


def _draw_rings(axes: Axes, graded: Sequence[tuple[float, int]], beyond_m: float) -> None:
    """Draws discs from the largest to the smallest, in the colours of costmaps."""
    turns = np.linspace(0.0, 2.0 * math.pi, 90)
    circle = np.column_stack([np.cos(turns), np.sin(turns)])
    seen = [(radius_m * circle, cost) for radius_m, cost in graded if radius_m <= beyond_m]
    # Each disc hides the larger one below it, though costs are half transparent.
    discs = [disc for disc, _ in seen for _ in range(2)]
    colors = [color for _, cost in seen for color in ("white", _rgba(cost))]
    rings = PolyCollection(discs, facecolors=colors, lw=0, zorder=0.4)
    axes.add_collection(rings, autolim=False)


def _rgba(cost: int) -> tuple[float, float, float, float]:
    clipped = int(np.clip(cost, 0, LETHAL if cost >= LETHAL else INSCRIBED))
    red, green, blue, alpha = (palette()[palette_rows()[clipped]] / 255.0).tolist()
    return red, green, blue, alpha


def _draw_scale(axes: Axes) -> None:
    """Draws a bar of a round length in the lower left corner."""
    low, high = axes.get_xlim()
    wanted = BAR_SHARE * (high - low)
    power = 10.0 ** math.floor(math.log10(wanted))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted)
    box = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.8}
    x = low + 0.03 * (high - low)
    bottom, top = axes.get_ylim()
    y = bottom + 0.03 * (high - low)
    y = min(y, bottom + 0.1 * (top - bottom))
    axes.plot([x, x + length], [y, y], color=INK, lw=3.0, solid_capstyle="butt", zorder=5)
    axes.annotate(
        f"{length:g} m",
        (x + 0.5 * length, y),
        xytext=(0, 5),
        ha="center",
        zorder=5,
        textcoords="offset points",
        fontsize=8,
        bbox=box,
    )
