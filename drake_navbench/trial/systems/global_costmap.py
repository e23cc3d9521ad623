"""The global costmap, on the grid of the map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_navbench.navigation.costmaps.layered_costmap import LayeredCostmap, LayersState
from drake_navbench.navigation.mission import FloorSwitch
from drake_navbench.trial.systems.costmap_system import CostmapSystem
from drake_navbench.trial.systems.floor_aware import FloorClock


class GlobalCostmap(CostmapSystem):
    """Nav2's global costmap; before the first scan it shows the map. Ports: see CostmapSystem.

    layers: as from `planning.global_layers`. pose: (3,) x m, y m, yaw rad of the robot at the
    start. floors: the layers of each floor of a mission.
    """

    def __init__(
        self,
        layers: LayeredCostmap,
        *,
        pose: NDArray[np.float64],
        period_s: float,
        offset_s: float,
        floors: Sequence[LayeredCostmap] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        super().__init__(
            layers,
            before_first_scan=layers.updated(
                layers.initial_state(), scan=None, pose=pose, time_s=0.0
            ),
            period_s=period_s,
            offset_s=offset_s,
            is_in_map=True,
            floors=floors,
            floor_clock=floor_clock,
        )

    def _before_first_scan(self, switch: FloorSwitch) -> LayersState:
        layers, pose = self._floors[switch.floor], np.array(switch.to_pose)
        return layers.updated(layers.initial_state(), scan=None, pose=pose, time_s=switch.time_s)
