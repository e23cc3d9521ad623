"""The differences of MPPI between Nav2's releases.

Source: nav2_mppi_controller, tags 1.1.20, 1.2.10, 1.3.13, 1.4.2 and 1.5.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

from drake_navbench.plugins.releases import Release


class Goal(IntEnum):
    """The end of the distance by which critics tell whether the goal is near.

    PATH: along the local plan to its end. PLAN_END: straight to the local plan's end. GOAL:
    straight to the goal itself.
    """

    PATH = 0
    PLAN_END = 1
    GOAL = 2


class Furthest(IntEnum):
    """The path points among which the nearest to a sample's end is searched.

    BY_LENGTH: up to the first that is as far as the sample is long. ONWARD: from the furthest one
    so far on. ALL: all of them.
    """

    BY_LENGTH = 0
    ONWARD = 1
    ALL = 2


class Rules(NamedTuple):
    """The behaviour of the controller in one release.

    cuts_plan: it cuts the local plan itself. takes_first_of_equals: it takes the first of equally
    close poses; else the last one. goal, furthest: see `Goal` and `Furthest`. heads_as_goal: near
    the goal the wanted heading is the goal's; else that of the local plan's end.
    turns_at_inversion: where plans are followed to their cusps, these are the goals.
    predicts_start: roll-outs and sequence start from the velocity that the robot can have reached
    towards the last command; else roll-outs start from the measured velocity, and the sequence from
    any. has_accelerations: roll-outs and sequence obey limits of acceleration. clamps_samples: the
    samples are averaged as clamped to these limits. filters_first: the filter comes before the
    limits, in every pass; else after them, once a cycle. filters_in_place: it reads values it has
    already filtered. curves_signed: a car that drives backwards in too tight a curve is made to
    turn the other way. has_validator: the averaged trajectory is checked. limits_axes: the
    constraint critic limits vx and vy; else the speed, by the norm of both limits. standing_spoils:
    the cost of a car that neither drives nor turns is NaN, which makes the controls NaN, and these
    are replaced by their upper limits; else such a step costs nothing. In Lyrical its turning
    radius is 0. finds_cells_in_float32: the cost critic computes cells in float32.
    drops_last_column: it leaves out the last of an odd number of columns. heeds_inflation_radius:
    it checks every outline where the inflation radius is less than the robot's.
    reads_inflation_layer: the obstacle critic reads radius and factor of the inflation layer; else
    parameters of its own. repels_above_least: the least repulsion of all samples counts as none,
    and repulsion adds to the margin's cost. aligns_onward: the path critic searches the point with
    the nearest arc length, from the last one on; else the first point that is as far.
    angles_at_end: the critic of angles looks at the samples' ends; else at all columns. is_patient:
    a cycle without valid control counts against the server's patience; else it ends the task at
    once. outlives_task: the optimizer is not reset between two tasks, but after a pause.
    task_lifts_limit, failure_lifts_limit: the reset between two tasks, and that after a failure,
    lifts the speed limit until another one is told.
    """

    cuts_plan: bool = True
    takes_first_of_equals: bool = False
    goal: Goal = Goal.GOAL
    furthest: Furthest = Furthest.ONWARD
    heads_as_goal: bool = False
    turns_at_inversion: bool = False
    predicts_start: bool = False
    has_accelerations: bool = True
    clamps_samples: bool = True
    filters_first: bool = False
    filters_in_place: bool = False
    curves_signed: bool = False
    has_validator: bool = False
    limits_axes: bool = False
    standing_spoils: bool = False
    finds_cells_in_float32: bool = True
    drops_last_column: bool = False
    heeds_inflation_radius: bool = True
    reads_inflation_layer: bool = True
    repels_above_least: bool = True
    aligns_onward: bool = True
    angles_at_end: bool = True
    is_patient: bool = True
    outlives_task: bool = False
    task_lifts_limit: bool = False
    failure_lifts_limit: bool = False


_IRON = Rules(
    goal=Goal.PLAN_END,
    furthest=Furthest.ALL,
    has_accelerations=False,
    clamps_samples=False,
    filters_in_place=True,
    curves_signed=True,
    finds_cells_in_float32=False,
    heeds_inflation_radius=False,
    repels_above_least=False,
    aligns_onward=False,
    angles_at_end=False,
    task_lifts_limit=True,
    failure_lifts_limit=True,
)
RULES: Mapping[Release, Rules] = {
    Release.HUMBLE: _IRON._replace(
        takes_first_of_equals=True,
        curves_signed=False,
        reads_inflation_layer=False,
        is_patient=False,
        outlives_task=True,
    ),
    Release.IRON: _IRON,
    Release.JAZZY: Rules(drops_last_column=True),
    Release.KILTED: Rules(
        heads_as_goal=True,
        turns_at_inversion=True,
        standing_spoils=True,
        failure_lifts_limit=True,
    ),
    Release.LYRICAL: Rules(
        cuts_plan=False,
        goal=Goal.PATH,
        furthest=Furthest.BY_LENGTH,
        predicts_start=True,
        clamps_samples=False,
        filters_first=True,
        has_validator=True,
        limits_axes=True,
    ),
}
