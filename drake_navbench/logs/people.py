"""Poses of a trial's people over time, and the compact column of the log that stores them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drake_navbench.kernels.immutable import Immutable

POSE_SIZE = 3
# The digits kept of positions, finer than any position is known; regular digits compress well.
DECIMALS = 4

# Column -> meaning, as for the columns of drake_navbench.logs.log. Only logs of worlds with people.
PEOPLE_COLUMNS: Mapping[str, str] = {
    "people": "ten times a second: x_m, y_m and yaw_rad of each person, one after the other, to "
    "0.1 mm; NaN while somebody of a recording is not there",
}


@dataclass(frozen=True, eq=False)
class LoggedPeople(Immutable):
    """The poses of a trial's P people over time, in the world frame.

    time_s: (T,) rising. poses: (T, P, 3) x m, y m, yaw rad, not wrapped; NaN while a person is not
    in the world.
    """

    time_s: NDArray[np.float64]
    poses: NDArray[np.float64]

    @property
    def person_count(self) -> int:
        """The number of people."""
        return int(self.poses.shape[1])


def people_columns(
    people: LoggedPeople | None, row_times_s: NDArray[np.float64]
) -> dict[str, pa.Array]:
    """Returns the column of a log table, none without people; row_times_s: of the samples."""
    if people is None:
        return {}
    values: list[NDArray[np.float32] | None] = [None] * len(row_times_s)
    for row, poses in zip(np.searchsorted(row_times_s, people.time_s), people.poses, strict=True):
        values[row] = np.round(poses, DECIMALS).ravel().astype(np.float32)
    return {"people": pa.array(values, type=pa.list_(pa.float32()))}


def read_people(table: pa.Table) -> LoggedPeople | None:
    """Returns the people of a log table, None where there are none; raises ValueError."""
    column = table["people"] if "people" in table.column_names else pa.chunked_array([], pa.null())
    if column.null_count == len(column):
        return None
    is_there = column.is_valid().to_numpy()
    times = table["time_s"].to_numpy()[is_there]
    poses = np.array(column.drop_null().to_pylist(), dtype=float)
    return LoggedPeople(times, poses.reshape(len(times), -1, POSE_SIZE))
