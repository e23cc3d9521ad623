"""The rolling local costmap around the robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.trial.systems.costmap_system import CostmapSystem
from drake_navbench.trial.systems.floor_aware import FloorClock


class LocalCostmap(CostmapSystem):
    """Nav2's local costmap; without a scan there is none yet. Ports: see CostmapSystem.

    footprint: (K, 2) padded outline in the base frame, m. static_map: for a static layer. masks:
    masks of the scenario's filters. floors: both of these for each floor of a mission.
    """

    def __init__(
        self,
        settings: LocalCostmapSettings,
        lidar: LidarSettings,
        *,
        footprint: NDArray[np.float64],
        offset_s: float,
        static_map: OccupancyMap | None = None,
        masks: Sequence[FilterMask] = (),
        floors: Sequence[tuple[OccupancyMap | None, Sequence[FilterMask]]] = (),
        floor_clock: FloorClock | None = None,
    ) -> None:
        layers, *of_floors = (
            local_layers(settings, lidar=lidar, footprint=footprint, static_map=known, masks=own)
            for known, own in ((static_map, masks), *floors)
        )
        super().__init__(
            layers,
            before_first_scan=layers.initial_state(),
            period_s=1.0 / settings.update_frequency,
            offset_s=offset_s,
            floors=of_floors,
            floor_clock=floor_clock,
        )
