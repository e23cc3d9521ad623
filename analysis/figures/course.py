"""A course seen from above: obstacles, plans, goals, and the paths of moving bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from drake_navbench.analysis.figures.style import (
    MOVING_COLOR,
    MOVING_FACE,
    OBSTACLE_EDGE,
    OBSTACLE_FACE,
    PLAN_COLOR,
    name_axes,
)
from drake_navbench.kernels.arrays import Array

MARGIN_M = 0.6
MAX_HEIGHT_IN, MIN_HEIGHT_IN, WIDTH_IN = 6.0, 1.8, 7.2


class Course(NamedTuple):
    """The obstacles and the task that a map shows; lengths in m, in the world frame.

    obstacles: the corners (K, 2) of each. plans: the first plan (N, 2) of each leg. is_replanned:
    whether later plans followed. waypoints: (W, 2). goal: (2,). ways: the path (N, 2) of each
    moving thing. movers: the corners (K, 2) of each moving thing at its start. floors: name and
    upper left corner (2,) of each floor; empty unless the mission leads over several floors.
    """

    obstacles: list[Array]
    plans: list[Array]
    is_replanned: bool
    waypoints: Array
    goal: Array
    ways: list[Array]
    movers: list[Array]
    floors: list[tuple[str, Array]]


def draw_course(axes: Axes, course: Course) -> None:
    """Draws obstacles, the first plan of each leg, waypoints and goal."""
    axes.add_collection(
        PolyCollection(
            course.obstacles,
            facecolor=OBSTACLE_FACE,
            edgecolor=OBSTACLE_EDGE,
            linewidth=0.8,
            label="obstacle" if course.obstacles else None,
        ),
        autolim=False,
    )
    for number, (way, corners) in enumerate(zip(course.ways, course.movers, strict=True)):
        label = "what moves, from its outline on" if number == 0 else None
        axes.plot(*way.T, color=MOVING_COLOR, lw=1.0, ls=":", label=label)
        axes.fill(*corners.T, facecolor=MOVING_FACE, edgecolor=MOVING_COLOR, lw=0.8)
    label = "first plan" if course.is_replanned else "plan"
    for number, plan in enumerate(course.plans):
        axes.plot(
            *plan.T,
            color=PLAN_COLOR,
            lw=1.0,
            ls=(0, (4, 3)),
            label=label if number == 0 else None,
        )
    mark: dict[str, Any] = {"mfc": "white", "mec": PLAN_COLOR, "ls": "none"}
    if len(course.waypoints):
        axes.plot(*course.waypoints.T, marker="D", ms=6, **mark, label="waypoint")
    axes.plot(*course.goal, marker="*", ms=11, **mark, label="goal")
    for name, corner in course.floors:
        axes.annotate(
            name, tuple(corner), xytext=(0, 3), textcoords="offset points", fontsize="small"
        )
    axes.set_aspect("equal")
    name_axes(axes, "paths")


def draw_outlines(axes: Axes, outlines: Sequence[Array], color: Any) -> None:
    """Draws outlines of a robot, (K, 2) m each."""
    for corners in outlines:
        axes.fill(*corners.T, fill=False, edgecolor=color, linewidth=1.0, zorder=2.5)
