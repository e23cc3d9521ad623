"""The global costmap, on the grid of the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drake_navbench.costmaps.layered_costmap import LayeredCostmap
from drake_navbench.systems.costmap_system import CostmapSystem


class GlobalCostmap(CostmapSystem):
    """Nav2's global costmap; before the first scan it shows the map. Ports: see CostmapSystem.

    layers: as from `planning.global_layers`. pose: (3,) where the robot starts, x m, y m, yaw rad.
    """

    def __init__(
        self,
        layers: LayeredCostmap,
        *,
        pose: NDArray[np.float64],
        period_s: float,
        offset_s: float,
    ) -> None:
        super().__init__(
            layers,
            before_first_scan=layers.updated(
                layers.initial_state(), scan=None, pose=pose, time_s=0.0
            ),
            period_s=period_s,
            offset_s=offset_s,
            is_in_map=True,
        )
