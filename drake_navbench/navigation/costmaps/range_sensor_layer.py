"""Nav2's layer of sonars and infrared sensors.

Source: nav2_costmap_2d (RangeSensorLayer), equal in Humble to Lyrical. After the costmap is cleared
Nav2 drops the readings that wait; here the newest of each sensor counts. A cone that lies wholly
left of or below the grid changes nothing here, where Nav2's loop over its cells does not end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.layer_grid import moved_cells
from drake_navbench.kernels.range_cone import EVEN_ODDS, Cone, cost_of, update_by_cone
from drake_navbench.navigation.costmaps.layer_plugin import (
    LayerParameters,
    LayerSetup,
    Observed,
    Seen,
)
from drake_navbench.navigation.costmaps.range_reading import RangeReading
from drake_navbench.typed_files.quantities import Duration, Length

Costs = NDArray[np.uint8]

UNSEEN_COST = cost_of(EVEN_ODDS)
VARIABLE, FIXED, ALL = "VARIABLE", "FIXED", "ALL"


class RangeSensorLayerParameters(LayerParameters):
    """Nav2's layer of range sensors."""

    topics: tuple[str, ...] = Field(
        min_length=1, description="Names of the robot's range_sensors that the layer uses."
    )
    input_sensor_type: str = Field(
        ALL,
        description="How a reading is taken: VARIABLE as a distance, FIXED as a switch (-inf: "
        "something is there, inf: nothing), ALL as FIXED where the sensor's two "
        "ranges are equal and else as VARIABLE; any other word means ALL.",
    )
    phi: Length = Field(1.2, description="Distance at which a reading is trusted by half [m].")
    inflate_cone: float = Field(
        1.0,
        ge=0.0,
        description="Share of the cone's area beside the cone in which cells are updated; "
        "from 1 on, all cells of the box around the cone are.",
    )
    clear_threshold: float = Field(
        0.2, ge=0.0, le=1.0, description="Probability of occupation below which a cell is free."
    )
    mark_threshold: float = Field(
        0.8, ge=0.0, le=1.0, description="Probability of occupation above which a cell is lethal."
    )
    clear_on_max_reading: bool = Field(
        False, description="Let a reading of the longest range free the whole cone."
    )
    no_readings_timeout: Duration = Field(
        0.0,
        ge=0.0,
        description="Time without a reading after which the costmap is not current until it "
        "is cleared [s]; 0: never.",
    )

    @field_validator("input_sensor_type")
    @classmethod
    def _known_type(cls, given: str) -> str:
        upper = given.upper()
        return upper if upper in (VARIABLE, FIXED) else ALL


@dataclass(frozen=True, eq=False)
class RangeState(Immutable):
    """The state of the layer.

    costs: (rows, columns) uint8, the probability that a cell is occupied, as a cost. origin: lower
    left corner of cell (0, 0), m. seen_until_s: time of the last cycle. last_reading_s: time of the
    newest cycle with a reading that counted, or of the first cycle. is_current: False once readings
    were missing.
    """

    costs: Costs
    origin: tuple[float, float]
    seen_until_s: float
    last_reading_s: float
    is_current: bool


class RangeSensorLayer:
    """Nav2's RangeSensorLayer on one grid."""

    Parameters: ClassVar[type[RangeSensorLayerParameters]] = RangeSensorLayerParameters
    stays_in_window = True

    def __init__(self, parameters: RangeSensorLayerParameters, setup: LayerSetup) -> None:
        self._parameters = parameters
        self._setup = setup

    def initial_state(self) -> RangeState | None:
        """See `Layer`; None stands for a grid in which nothing was seen."""
        return None

    def observe(self, state: RangeState | None, seen: Seen) -> Observed:
        """See `Layer`: takes all readings since its last cycle, the oldest first."""
        grid = Grid(self._moved(state, seen), *seen.origin, self._setup.resolution)
        boxes = [
            update_by_cone(
                grid,
                cone,
                phi=self._parameters.phi,
                inflate_cone=self._parameters.inflate_cone,
            )
            for reading in self._new_readings(state, seen)
            if (cone := self._cone(reading)) is not None
        ]
        last_s = seen.time_s if boxes or state is None else state.last_reading_s
        timeout_s = self._parameters.no_readings_timeout
        is_missing = 0.0 < timeout_s < seen.time_s - last_s
        is_current = not is_missing and (state is None or state.is_current)
        after = RangeState(grid.costs, seen.origin, seen.time_s, last_s, is_current)
        return Observed(after, _around(boxes) if boxes else None)

    def is_current(self, state: RangeState) -> bool:
        """See `Layer`."""
        return state.is_current

    def write(self, state: RangeState, grid: Grid, seen: Seen) -> Costs:
        """See `Layer`."""
        own, master = state.costs[seen.slices], grid.costs[seen.slices]
        is_marked = own > cost_of(self._parameters.mark_threshold)
        is_clear = ~is_marked & (own < cost_of(self._parameters.clear_threshold))
        master[is_marked] = LETHAL
        master[is_clear & (master == NO_INFORMATION)] = FREE
        return grid.costs

    def _moved(self, state: RangeState | None, seen: Seen) -> Costs:
        """Returns the state's cells as a new array at the costmap's present place."""
        if state is None:
            return np.full((self._setup.rows, self._setup.columns), UNSEEN_COST, np.uint8)
        resolution = self._setup.resolution
        return moved_cells(
            state.costs, state.origin, seen.origin, resolution=resolution, default=UNSEEN_COST
        )

    def _new_readings(self, state: RangeState | None, seen: Seen) -> list[RangeReading]:
        """Returns the readings of the layer's sensors since its last cycle, by their time."""
        new: list[RangeReading] = []
        for name in dict.fromkeys(self._parameters.topics):
            readings = seen.ranges.get(name, ())
            if state is None:
                new += readings[-1:]
            else:
                new += [one for one in readings if one.time_s > state.seen_until_s]
        return sorted(new, key=lambda reading: reading.time_s)

    def _cone(self, reading: RangeReading) -> Cone | None:
        """Returns the cone that a reading clears or marks; None for a reading without meaning."""
        kind = self._parameters.input_sensor_type
        is_switch = reading.range_min_m == reading.range_max_m if kind == ALL else kind == FIXED
        range_m, clears = reading.range_m, False
        if is_switch:
            if not np.isinf(range_m):
                return None
            clears, range_m = range_m > 0.0, reading.range_min_m
            if clears and not self._parameters.clear_on_max_reading:
                return None
        elif not reading.is_within_range:
            return None
        else:
            at_the_end = range_m >= reading.range_max_m
            clears = at_the_end and self._parameters.clear_on_max_reading
        x, y, yaw = (float(value) for value in reading.sensor_pose)
        return Cone(x, y, yaw, float(range_m), 0.5 * reading.field_of_view_rad, clears)


def _around(boxes: list[Any]) -> tuple[float, float, float, float]:
    """Returns the box min_x, min_y, max_x, max_y m around several boxes."""
    stacked = np.array(boxes)
    low, high = stacked[:, :2].min(axis=0), stacked[:, 2:].max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
