"""The result of reading whole Nav2 files: columns, the robot that they drive, and the check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from drake_navbench.controller import AskedSpeeds
from drake_navbench.inputs.check import Check
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.controllers import SERVER, NoCounterpart
from drake_navbench.nav2.node_reader import Offer
from drake_navbench.typed_files.yaml_loader import dump_yaml


@dataclass(frozen=True)
class Nav2Setup:
    """The columns that Nav2 files define, the robot that they drive, and the check of the files.

    places: by the column's name, the node and the block of its controller. given: the values of all
    parameters, by node without the namespace and by name. offers: the typed parameters outside of
    the controllers, by the last part of the node's name and by name. needed_speeds: the speeds that
    each controller needs of the base. spin_radps: the yaw rate that the spin needs. namespace: the
    one of the nodes that are read, 'robot1'. without_column: why none of a server's controllers
    exists here; None where each server has one that does, or none at all.
    """

    presets: tuple[Preset, ...]
    robot: Robot
    check: Check
    places: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    given: Mapping[tuple[str, str], Any] = field(default_factory=dict)
    offers: Mapping[tuple[str, str], Offer] = field(default_factory=dict)
    needed_speeds: tuple[AskedSpeeds, ...] = ()
    spin_radps: float = 0.0
    namespace: str = ""
    without_column: NoCounterpart | None = None

    def require_columns(self) -> None:
        """Raises InputError where a server has controllers, but none that exists here."""
        if self.without_column is not None:
            raise self.without_column

    @property
    def controllers(self) -> dict[str, Preset]:
        """The columns by their controller's name in the files, 'FollowPath'.

        In files of several robots those after the first are 'robot2/FollowPath'.
        """
        named: dict[str, Preset] = {}
        for preset in self.presets:
            node, name = self.places[preset.name]
            namespace = node.removesuffix(SERVER)
            named[f"{namespace}{name}" if name in named else name] = preset
        return named

    def stand_ins_of(self, column: str) -> list[str]:
        """Returns a line for each stand-in within a column's controller."""
        node, block = self.places.get(column, ("", ""))
        return [
            row.text
            for row in self.check.stand_ins
            if block and row.node == node and row.parameter.split(".")[0] == block
        ]

    def stand_ins_of_all(self) -> list[str]:
        """Returns a line for each stand-in outside of the controllers, common to all columns."""
        own = {line for column in self.places for line in self.stand_ins_of(column)}
        return [row.text for row in self.check.stand_ins if row.text not in own]

    def robot_file(self) -> str:
        """Returns the robot as the text of a robot file that can be kept."""
        data = self.robot.model_dump(mode="json", exclude_unset=True)
        data.pop("directory", None)
        if self.robot.model_path is not None:
            data["model"] = str(self.robot.model_path)
        return dump_yaml(data, sort_keys=False)
