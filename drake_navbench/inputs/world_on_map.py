"""A world of Gazebo beside the map that its robot plans on, both in one frame."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drake_navbench.errors import InputWarning
from drake_navbench.inputs.gazebo_world import GazeboWorld, occupancy_of
from drake_navbench.kernels.arrays import Array
from drake_navbench.navigation.costmaps.map_file import OccupancyMap, load_map
from drake_navbench.navigation.costmaps.map_image import OCCUPIED, UNKNOWN

# The largest distance of a map's occupied cell from the obstacle that it shows, m.
NEAR_M = 0.3
# Below this share of such cells the map is that of another world, or in another frame.
LEAST_SHARE = 0.5


def free_on_both(floor: OccupancyMap, known: OccupancyMap) -> OccupancyMap:
    """Returns a world's floor where cells that its map does not show as free are unknown."""
    values = _values(known, *_centres(floor, np.indices(floor.occupancy.shape)))
    occupancy = np.where((floor.occupancy == 0) & (values != 0), UNKNOWN, floor.occupancy)
    return replace(floor, occupancy=occupancy.astype(np.int8))


def warn_of_other_world(world: GazeboWorld, file: Path) -> None:
    """Warns where most of what a map shows does not stand in the world; raises InputError."""
    share = share_that_stands(occupancy_of(world), load_map(file))
    if share < LEAST_SHARE:
        remark = (
            f"{file}: {share:.0%} of its occupied cells are within {NEAR_M:g} m of something in "
            f"{world.path}; expected a map of this world in its frame"
        )
        warnings.warn(remark, InputWarning, stacklevel=2)


def share_that_stands(floor: OccupancyMap, known: OccupancyMap) -> float:
    """Returns the share of a map's occupied cells that are near something in a world."""
    occupied = np.array(np.nonzero(known.is_occupied))
    if not occupied.size:
        return 1.0
    stands = np.pad(floor.is_occupied, 1)
    distance = ndimage.distance_transform_edt(~stands)[1:-1, 1:-1] * floor.resolution
    near = replace(floor, occupancy=np.where(distance <= NEAR_M, OCCUPIED, 0).astype(np.int8))
    return float((_values(near, *_centres(known, occupied)) == OCCUPIED).mean())


def _centres(grid: OccupancyMap, cells: NDArray[np.int64]) -> tuple[Array, Array]:
    """Returns x and y of the centres of cells, m; cells: (2, ...) rows and columns."""
    rows, columns = cells.astype(float)
    x = grid.origin_x + (columns + 0.5) * grid.resolution
    return x, grid.origin_y + (rows + 0.5) * grid.resolution


def _values(grid: OccupancyMap, x: Array, y: Array) -> NDArray[np.int8]:
    """Returns the occupancy at places, unknown off the grid."""
    columns = np.floor((x - grid.origin_x) / grid.resolution).astype(int)
    rows = np.floor((y - grid.origin_y) / grid.resolution).astype(int)
    is_on = (rows >= 0) & (rows < grid.occupancy.shape[0])
    is_on &= (columns >= 0) & (columns < grid.occupancy.shape[1])
    return np.where(is_on, grid.occupancy[rows * is_on, columns * is_on], UNKNOWN).astype(np.int8)
