"""The differences of the Rotation Shim between Nav2's releases."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.plugins.releases import Release


class Rules(NamedTuple):
    """The behaviour of the shim in one release.

    looks_always: compares its heading with the plan's in every cycle; else a plan is looked at
        until the robot faces it, or cannot turn, and then no more. With it
        `rotate_to_heading_once` has no effect: it compares goals with their time stamps, which the
        controller server renews in every cycle.
        The goal checker says whether the goal's position is reached; else the distance does.
    cuts_plan: looks at the path handler's part of the plan, which begins at the robot; else at the
        whole plan.
    keeps_position: once reached, the goal's position counts as reached until the next plan.
    takes_last_pose: a plan shorter than the sampling distance has the heading of its last pose;
        else it has none.
    stops_in_time: as in `kernels.Settings`.
    is_reset: between two tasks it forgets its last command.
    disengage_threshold: default of `angular_disengage_threshold`, rad.
    """

    looks_always: bool = False
    cuts_plan: bool = False
    keeps_position: bool = True
    takes_last_pose: bool = True
    stops_in_time: bool = True
    is_reset: bool = True
    disengage_threshold: float = 0.785 / 2.0


RULES: Mapping[Release, Rules] = {
    Release.HUMBLE: Rules(
        takes_last_pose=False,
        stops_in_time=False,
        is_reset=False,
        disengage_threshold=0.785,
    ),
    Release.IRON: Rules(
        keeps_position=False,
        stops_in_time=False,
        is_reset=False,
    ),
    Release.JAZZY: Rules(),
    Release.KILTED: Rules(),
    Release.LYRICAL: Rules(looks_always=True, cuts_plan=True),
}
