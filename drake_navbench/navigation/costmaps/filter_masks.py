"""The areas of costmap filters: masks from map files, or polygons drawn as masks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from drake_navbench.errors import InputError
from drake_navbench.kernels.grid import FREE, LETHAL, Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.rasterize import MASK_FULL, mark_polygon
from drake_navbench.navigation.costmaps.grid_size import require_grid_size
from drake_navbench.navigation.costmaps.map_file import OccupancyMap, load_map
from drake_navbench.typed_files.quantities import Number, Point
from drake_navbench.typed_files.typed_yaml import FrozenModel

FilterType = Literal["keepout", "speed_percent", "speed_absolute", "binary"]
FilterName = Literal["keepout_filter", "speed_filter", "binary_filter"]
FILTER_NAMES: Mapping[FilterType, FilterName] = {
    "keepout": "keepout_filter",
    "speed_percent": "speed_filter",
    "speed_absolute": "speed_filter",
    "binary": "binary_filter",
}
# The distance from a line of the lattice that counts as rounding, in cells.
ROUNDING_CELLS = 1e-6


class FilterArea(FrozenModel):
    """A polygon and the mask value inside it."""

    polygon: list[Point] = Field(min_length=3, description="Corners of the area in order [m].")
    value: int = Field(MASK_FULL, ge=0, le=MASK_FULL, description="Mask value inside the area [%].")

    @field_validator("polygon")
    @classmethod
    def _check(cls, polygon: list[Point]) -> list[Point]:
        region = shapely.Polygon(polygon)
        if not region.is_valid or region.area == 0.0:
            raise ValueError("expected a polygon with an area that does not cross itself")
        return polygon


class FilterDescription(FrozenModel):
    """One costmap filter of a scenario: Nav2's filter info, and its mask or its areas."""

    type: FilterType = Field(description="Meaning of the mask's values.")
    mask: str | None = Field(
        None, description="Path of the mask's map file from the scenario's folder."
    )
    areas: list[FilterArea] = Field(
        default_factory=list,
        description="Areas instead of a mask file; where areas overlap, the last one applies.",
    )
    base: Number = Field(0.0, description="Filter value at mask value 0 [%, m/s or -].")
    multiplier: Number = Field(
        1.0, description="Change of the filter value per unit of the mask value [%, m/s or -]."
    )

    @property
    def filter_name(self) -> FilterName:
        """The name under which costmaps list the filter of this type."""
        return FILTER_NAMES[self.type]

    @model_validator(mode="after")
    def _check(self) -> FilterDescription:
        if (self.mask is None) == (not self.areas):
            raise ValueError("expected either a mask or areas, and not both")
        if self.type == "keepout" and (self.base, self.multiplier) != (0.0, 1.0):
            raise ValueError(
                f"base {self.base:g} and multiplier {self.multiplier:g} have no meaning for a "
                "keepout; expected 0 and 1"
            )
        return self


@dataclass(frozen=True, eq=False)
class FilterMask(Immutable):
    """A mask on its grid, in the frame of the map, with the filter info that gives it meaning."""

    type: FilterType
    grid: OccupancyMap
    base: float = 0.0
    multiplier: float = 1.0

    @property
    def filter_name(self) -> FilterName:
        """The name under which costmaps list the filter that reads the mask."""
        return FILTER_NAMES[self.type]

    def value_at(self, position: NDArray[np.float64]) -> int | None:
        """Returns the mask value of the cell that holds (2,) m, -1 unknown; None off the mask."""
        return self.grid.value_at(position)


class Lattice(NamedTuple):
    """The grid of drawn masks: a corner of one of its cells, and the cell edge, m."""

    corner_x: float
    corner_y: float
    resolution: float


def load_filter_mask(
    description: FilterDescription,
    *,
    file: Path | None,
    bounds: tuple[float, float, float, float],
    lattice: Lattice,
) -> FilterMask:
    """Returns the mask of a filter.

    file: the mask's file; None where areas are drawn. bounds: min_x, min_y, max_x, max_y m of the
    world. The grid of drawn areas covers it; a mask from a file must meet it. lattice: the cells of
    drawn masks; with the costmap's own lattice it shows them as they were drawn. Raises InputError,
    one line, where the mask cannot be read or lies elsewhere.
    """
    if file is None:
        grid = _draw_areas(description.areas, bounds, lattice)
    else:
        grid = load_map(file)
        if not shapely.box(*grid.bounds).intersects(shapely.box(*bounds)):
            raise InputError(
                f"{file}: origin: the mask covers {_rectangle(grid.bounds)}, expected it to meet "
                f"the world at {_rectangle(bounds)}; is it in the frame of another map?"
            )
    return FilterMask(description.type, grid, description.base, description.multiplier)


def _draw_areas(
    areas: list[FilterArea], bounds: tuple[float, ...], lattice: Lattice
) -> OccupancyMap:
    points = np.vstack([np.array(area.polygon) for area in areas] + [np.reshape(bounds, (2, 2))])
    corner, resolution = np.array([lattice.corner_x, lattice.corner_y]), lattice.resolution
    # A bound that is on the lattice but for rounding needs no further cell.
    first = np.floor((points.min(axis=0) - corner) / resolution + ROUNDING_CELLS)
    last = np.ceil((points.max(axis=0) - corner) / resolution - ROUNDING_CELLS)
    require_grid_size("filters: a mask drawn from areas", *(last - first))
    columns, rows = (last - first).astype(int)
    origin_x, origin_y = (corner + first * resolution).tolist()
    mask = np.zeros((rows, columns), dtype=np.int8)
    for area in areas:
        drawn = np.full((rows, columns), FREE, dtype=np.uint8)
        mark_polygon(
            Grid(drawn, origin_x, origin_y, resolution), np.array(area.polygon, dtype=float)
        )
        mask[drawn == LETHAL] = area.value
    mask.flags.writeable = False
    return OccupancyMap(mask, resolution, origin_x, origin_y)


def _rectangle(bounds: tuple[float, ...]) -> str:
    min_x, min_y, max_x, max_y = bounds
    return f"x {min_x:g} to {max_x:g} m, y {min_y:g} to {max_y:g} m"
