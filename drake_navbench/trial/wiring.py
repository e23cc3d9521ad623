"""The diagram of a trial while it is wired."""

from __future__ import annotations

from typing import NamedTuple

from pydrake.geometry import SceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_navbench.inputs.faults import Conditions
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.world import World
from drake_navbench.trial.floors import TrialFloors
from drake_navbench.trial.systems.floor_aware import FloorClock


class Wiring(NamedTuple):
    """A trial's builder and scene graph, and the inputs from which most of its systems are made.

    conditions: the settings of the robot's parts at each time. floors: None on one floor.
    """

    builder: DiagramBuilder
    scene_graph: SceneGraph
    robot: Robot
    world: World
    conditions: Conditions
    floors: TrialFloors | None

    @property
    def floor_clock(self) -> FloorClock | None:
        """The instants at which the floor may change, None on one floor."""
        return None if self.floors is None else self.floors.clock
