"""The differences of Vector Pursuit between Nav2's releases.

Source: vector_pursuit_controller, branches master (1.0, for Humble) and jazzy-devel (1.1, for Jazzy
and later). No version exists for Lyrical, whose controllers do not cut the plan: there the
controller applies the first version's arithmetic to the plan that the path handler leaves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drake_navbench.plugins.releases import Release


class Rules(NamedTuple):
    """The behaviour of the controller in one release.

    cuts_plan: takes the whole plan, and cuts it at a circle.
    takes_first_of_equals: takes the first of equally close poses; else the last one.
    is_mirrored: the screw's angle counts to either side alike; else from 0 to 2 pi.
    is_patient: the server's patience applies to all of its errors; else each ends the task.
    """

    cuts_plan: bool = True
    takes_first_of_equals: bool = False
    is_mirrored: bool = True
    is_patient: bool = False


RULES: Mapping[Release, Rules] = {
    Release.HUMBLE: Rules(takes_first_of_equals=True, is_mirrored=False, is_patient=True),
    Release.IRON: Rules(),
    Release.JAZZY: Rules(),
    Release.KILTED: Rules(),
    Release.LYRICAL: Rules(cuts_plan=False, is_mirrored=False, is_patient=True),
}
