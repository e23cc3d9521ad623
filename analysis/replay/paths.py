"""Paths and colours of the drawn objects in Meshcat's tree."""

from __future__ import annotations

from pydrake.geometry import Rgba

LAYER_COLOR = "#8a94a3"
MOVING_PATH = "/moving"


class RobotPaths:
    """The Meshcat paths of a controller's robot; a slash in its name would start another level.

    group: all that is its own. costmap: beside the group, so that it stays on the floor.
    """

    def __init__(self, controller: str) -> None:
        name = controller.replace("/", "_")
        self.group = f"/controllers/{name}"
        self.robot = f"{self.group}/robot"
        self.driven = f"{self.group}/path"
        self.people = f"{self.group}/people"
        self.scan = f"{self.group}/scan"
        self.costmap = f"/local_costmap/{name}"


def rgba_of(color: str) -> Rgba:
    """Returns Drake's form of '#rrggbb'."""
    return Rgba(*(channel / 255 for channel in bytes.fromhex(color.removeprefix("#"))))


def css_color(rgba: Rgba) -> str:
    """Returns a colour as '#rrggbb'."""
    channels = (rgba.r(), rgba.g(), rgba.b())
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in channels)
