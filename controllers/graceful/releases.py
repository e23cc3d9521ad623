"""The differences of the Graceful Controller between Nav2's releases.

Source: nav2_graceful_controller, branches humble, jazzy, kilted and lyrical. Iron does not have it:
a file for Iron that names it drives by Jazzy's rules.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.plugins.releases import Release


class Rules(NamedTuple):
    """The behaviour of the controller in one release.

    cuts_plan: takes the whole plan, cuts it at a circle, and tells from the length of the rest
        whether the goal is near.
    aims_once: has one target, the first pose at a straight distance, and no other where the way
        there is blocked; else it comes nearer, pose by pose.
    takes_first_of_equals: takes the first of equally close poses; else the last one.
    is_patient: every error counts as no valid control, to which the server's patience applies.
    """

    cuts_plan: bool = False
    aims_once: bool = False
    takes_first_of_equals: bool = False
    is_patient: bool = False


RULES: Mapping[Release, Rules] = {
    Release.HUMBLE: Rules(
        cuts_plan=True, aims_once=True, takes_first_of_equals=True, is_patient=True
    ),
    Release.IRON: Rules(cuts_plan=True),
    Release.JAZZY: Rules(cuts_plan=True),
    Release.KILTED: Rules(cuts_plan=True),
    Release.LYRICAL: Rules(),
}
