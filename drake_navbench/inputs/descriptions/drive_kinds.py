"""The kinds of drives, and the words by which plugins and controllers name them."""

from __future__ import annotations

from typing import NamedTuple

DIFFERENTIAL, OMNIDIRECTIONAL, ACKERMANN = "differential", "omnidirectional", "ackermann"
# Words in a plugin's file or name, or a controller's type -> kind of drive; the first fit counts.
KINDS = (
    # Gazebo's MulticopterVelocityControl flies.
    ("multicopter", ""),
    ("ackermann", ACKERMANN),
    ("tricycle", ACKERMANN),
    ("bicycle_steering", ACKERMANN),
    ("mecanum", OMNIDIRECTIONAL),
    ("planar_move", OMNIDIRECTIONAL),
    ("planar-move", OMNIDIRECTIONAL),
    # "omni" alone would not do: there are omnidirectional receivers and cameras.
    ("omni_wheel", OMNIDIRECTIONAL),
    ("omni_drive", OMNIDIRECTIONAL),
    ("omnidirectional", OMNIDIRECTIONAL),
    ("velocity-control", OMNIDIRECTIONAL),
    ("diff_drive", DIFFERENTIAL),
    ("diff-drive", DIFFERENTIAL),
    ("diffdrive", DIFFERENTIAL),
    ("skid_steer", DIFFERENTIAL),
    ("skid-steer", DIFFERENTIAL),
)
# Plugins that move the body itself, and read nothing of its wheels.
BODY_MOVERS = ("planar_move", "planar-move", "velocity-control")
# The largest angle of the steering, rad, on the way to the turning radius.
STEERING = "steering_limit_rad"


class FoundDrive(NamedTuple):
    """A drive as a robot's model describes it.

    kind: '' for unknown. source: the part of the model that tells it. values: by our own names, SI
    units. remark: a limit in the files that is not used, and why; '' without one. differs: how its
    wheels differ from those of the model's links; '' without a difference. steering: joints that
    the plugin or controller steers, by its own words. is_guess: whether neither plugin nor
    controller tells the kind, but the wheels' number, names and axles. may_roll_sideways: whether
    they are more than two, of which the model does not tell whether they are mecanum wheels.
    """

    kind: str
    source: str
    values: dict[str, float]
    remark: str = ""
    differs: str = ""
    steering: frozenset[str] = frozenset()
    is_guess: bool = False
    may_roll_sideways: bool = False


def kind_of(text: str) -> str:
    """Returns the kind of drive that a text names by the first word that fits, '' for none."""
    return next((kind for word, kind in KINDS if word in text.lower()), "")
