"""The differences of Regulated Pure Pursuit between Nav2's releases.

Source: nav2_regulated_pure_pursuit_controller, tags 1.1.20, 1.2.10, 1.3.13, 1.4.2 and 1.5.1.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.plugins.releases import Release


class Rules(NamedTuple):
    """The behaviour of the controller in one release; kernels read it, too.

    cuts_plan: takes the whole plan and cuts it itself. The carrot lies at a straight distance from
        the robot; the distance to it decides whether the robot turns to the goal's heading.
    takes_first_of_equals: takes the first of equally close poses; else the last one.
    keeps_two_poses: the cut plan never begins with the last pose in reach.
    steers_by_carrot: the fixed curvature lookahead slows down only; the carrot steers.
    heeds_turns_in_place: poses in one place with other headings are a cusp.
    turns_or_reverses: reverses only where it does not turn in place.
    stops_in_time: a turn in place is slow enough to be stopped in time.
    bounds_time_only: `min_distance_to_obstacle` makes the check longer, but not farther.
    decays_from_252: distances are computed from costs by a decay from 252, the layer's own.
    is_patient: every error counts as no valid control, to which the server's patience applies.
    """

    cuts_plan: bool = False
    takes_first_of_equals: bool = False
    keeps_two_poses: bool = True
    steers_by_carrot: bool = False
    heeds_turns_in_place: bool = True
    turns_or_reverses: bool = False
    stops_in_time: bool = True
    bounds_time_only: bool = False
    decays_from_252: bool = False
    is_patient: bool = False


RULES: Mapping[Release, Rules] = {
    Release.HUMBLE: Rules(
        cuts_plan=True,
        takes_first_of_equals=True,
        keeps_two_poses=False,
        heeds_turns_in_place=False,
        turns_or_reverses=True,
        decays_from_252=True,
        is_patient=True,
    ),
    Release.IRON: Rules(
        cuts_plan=True,
        keeps_two_poses=False,
        steers_by_carrot=True,
        turns_or_reverses=True,
        stops_in_time=False,
    ),
    Release.JAZZY: Rules(cuts_plan=True),
    Release.KILTED: Rules(cuts_plan=True, bounds_time_only=True),
    Release.LYRICAL: Rules(),
}
