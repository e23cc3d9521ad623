"""How the Graceful Controller differs between Nav2's releases.

Source: nav2_graceful_controller, branches humble, jazzy, kilted and lyrical. Iron does not have it;
what names it there follows Jazzy.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple


class Release(NamedTuple):
    """What the controller does in a release.

    cuts_plan: takes the whole plan, cuts it at a circle, and tells from the length of what is left
        whether the goal is near.
    aims_once: has one target, the first pose at a straight distance, and no other where the way
        there is blocked; else it comes nearer, pose by pose.
    takes_first_of_equals: among equally close poses; else the last one.
    is_patient: every error counts as no valid control, to which the server's patience applies.
    """

    cuts_plan: bool = False
    aims_once: bool = False
    takes_first_of_equals: bool = False
    is_patient: bool = False


RELEASES = MappingProxyType(
    {
        "humble": Release(
            cuts_plan=True, aims_once=True, takes_first_of_equals=True, is_patient=True
        ),
        "iron": Release(cuts_plan=True),
        "jazzy": Release(cuts_plan=True),
        "kilted": Release(cuts_plan=True),
        "lyrical": Release(),
    }
)
