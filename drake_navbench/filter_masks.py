"""The areas of costmap filters: masks from map files, or polygons drawn as masks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from drake_navbench.costmap_settings import FilterName
from drake_navbench.errors import InputError
from drake_navbench.immutable import Immutable
from drake_navbench.kernels.grid import FREE, LETHAL
from drake_navbench.kernels.rasterize import MASK_FULL, mark_polygon
from drake_navbench.map_file import OccupancyMap, load_map
from drake_navbench.typed_yaml import FrozenModel

FilterType = Literal["keepout", "speed_percent", "speed_absolute", "binary"]
FILTER_NAMES: Mapping[FilterType, FilterName] = {
    "keepout": "keepout_filter",
    "speed_percent": "speed_filter",
    "speed_absolute": "speed_filter",
    "binary": "binary_filter",
}
Point = tuple[float, float]
# Cell edge of the masks that are drawn from polygons, m.
DRAWN_RESOLUTION_M = 0.05


class FilterArea(FrozenModel):
    """A polygon and the mask value inside it."""

    polygon: list[Point] = Field(min_length=3, description="Corners in order [m].")
    value: int = Field(MASK_FULL, ge=0, le=MASK_FULL, description="Mask value inside [%].")

    @field_validator("polygon")
    @classmethod
    def _check(cls, polygon: list[Point]) -> list[Point]:
        region = shapely.Polygon(polygon)
        if not region.is_valid or region.area == 0.0:
            raise ValueError("expected a polygon with an area that does not cross itself")
        return polygon


class FilterDescription(FrozenModel):
    """One costmap filter of a scenario: Nav2's filter info, and its mask or its areas."""

    type: FilterType = Field(description="What the mask means.")
    mask: str | None = Field(None, description="Map file, relative to the scenario's folder.")
    areas: list[FilterArea] = Field(
        default_factory=list, description="Instead of a mask; where they overlap, the last counts."
    )
    base: float = Field(0.0, description="Filter value at mask value 0 [%, m/s or -].")
    multiplier: float = Field(1.0, description="Filter value per mask value [%, m/s or -].")

    @property
    def filter_name(self) -> FilterName:
        """The filter that it is for, as costmaps list it."""
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
        """The filter that it is for, as costmaps list it."""
        return FILTER_NAMES[self.type]

    def value_at(self, position: NDArray[np.float64]) -> int | None:
        """Returns the mask value of the cell that holds (2,) m, -1 unknown; None off the mask."""
        return self.grid.value_at(position)


def load_filter_mask(
    description: FilterDescription, *, directory: Path, bounds: tuple[float, float, float, float]
) -> FilterMask:
    """Returns the mask of a filter.

    directory: what a relative mask path starts from. bounds: min_x, min_y, max_x, max_y m of the
    world: polygons are drawn on a grid that covers it, a mask from a file must meet it. Raises
    InputError, one line, where the mask cannot be read or lies elsewhere.
    """
    if description.mask is None:
        grid = _draw_areas(description.areas, bounds)
    else:
        path = directory / description.mask
        grid = load_map(path)
        if grid.origin_yaw != 0.0:
            raise InputError(
                f"{path}: origin: a mask cannot be turned against the map, got yaw "
                f"{grid.origin_yaw:g} rad, expected 0"
            )
        if not shapely.box(*grid.bounds).intersects(shapely.box(*bounds)):
            raise InputError(
                f"{path}: origin: the mask covers {_rectangle(grid.bounds)}, expected it to meet "
                f"the world at {_rectangle(bounds)}; is it in the frame of another map?"
            )
    return FilterMask(description.type, grid, description.base, description.multiplier)


def _draw_areas(areas: list[FilterArea], bounds: tuple[float, ...]) -> OccupancyMap:
    corners = np.vstack([np.array(area.polygon) for area in areas] + [np.reshape(bounds, (2, 2))])
    low = np.floor(corners.min(axis=0) / DRAWN_RESOLUTION_M) * DRAWN_RESOLUTION_M
    columns, rows = np.ceil((corners.max(axis=0) - low) / DRAWN_RESOLUTION_M).astype(int)
    mask = np.zeros((rows, columns), dtype=np.int8)
    for area in areas:
        drawn = np.full((rows, columns), FREE, dtype=np.uint8)
        mark_polygon(drawn, *low, DRAWN_RESOLUTION_M, np.array(area.polygon, dtype=float))
        mask[drawn == LETHAL] = area.value
    mask.flags.writeable = False
    return OccupancyMap(mask, DRAWN_RESOLUTION_M, float(low[0]), float(low[1]))


def _rectangle(bounds: tuple[float, ...]) -> str:
    min_x, min_y, max_x, max_y = bounds
    return f"x {min_x:g} to {max_x:g} m, y {min_y:g} to {max_y:g} m"
