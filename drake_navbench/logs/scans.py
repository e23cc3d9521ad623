"""The lidar scans of a trial, and the column in which its log keeps them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drake_navbench.kernels.poses import compose
from drake_navbench.typed_files.immutable import Immutable

Number = TypeVar("Number", bound=np.floating[Any])

SCAN_TYPE = pa.struct(
    [
        ("time_s", pa.float64()),
        ("sensor_pose", pa.list_(pa.float64())),
        ("ranges_m", pa.list_(pa.float32())),
    ]
)
# The names of the columns that Parquet makes of the scans' column.
SCAN_LEAVES = ("scan.time_s", "scan.sensor_pose.list.element", "scan.ranges_m.list.element")


@dataclass(frozen=True, eq=False)
class Scan(Immutable):
    """One lidar scan as it was recorded.

    time_s: when it was taken. sensor_pose: (3,) x m, y m, yaw rad in the world frame.
    angles_rad: (B,) beam angles in the sensor frame. ranges_m: (B,) inf where nothing was hit.
    further: the scans of the robot's other scanners at the same time; a log does not keep them.
    odometry_pose: (3,) pose of the sensor in the odometry frame; None where that is the world
        frame. A log does not keep it.
    """

    time_s: float
    sensor_pose: NDArray[np.float64]
    angles_rad: NDArray[np.float64]
    ranges_m: NDArray[np.float32]
    further: tuple[Scan, ...] = ()
    odometry_pose: NDArray[np.float64] | None = None

    def placed_by_odometry(self, frame_from_odometry: NDArray[np.float64] | None = None) -> Scan:
        """Returns the scan as the robot places it, in the odometry's frame or another one.

        frame_from_odometry: (3,) pose of the odometry frame in the other frame.
        """
        if self.odometry_pose is None:
            return self
        pose = self.odometry_pose
        if frame_from_odometry is not None:
            pose = compose(frame_from_odometry, pose)
        further = tuple(scan.placed_by_odometry(frame_from_odometry) for scan in self.further)
        return replace(self, sensor_pose=pose, further=further, odometry_pose=None)

    @property
    def of_all_scanners(self) -> tuple[Scan, ...]:
        """This scan and those of the other scanners."""
        return (self, *self.further)

    @property
    def hits(self) -> NDArray[np.float64]:
        """(H, 2) points hit, world frame, m."""
        valid = np.isfinite(self.ranges_m)
        bearing = self.sensor_pose[2] + self.angles_rad[valid]
        direction = np.column_stack([np.cos(bearing), np.sin(bearing)])
        return self.sensor_pose[:2] + self.ranges_m[valid, None] * direction


def scan_columns(scans: Sequence[Scan], rows: Sequence[int], row_count: int) -> dict[str, pa.Array]:
    """Returns the column of a log table; rows: the row of each scan."""
    values: list[dict[str, Any] | None] = [None] * row_count
    for scan, row in zip(scans, rows, strict=True):
        values[row] = {
            "time_s": scan.time_s,
            "sensor_pose": scan.sensor_pose,
            "ranges_m": scan.ranges_m,
        }
    return {"scan": pa.array(values, type=SCAN_TYPE)}


def read_scans(column: pa.ChunkedArray, angles_rad: NDArray[np.float64]) -> Iterator[Scan]:
    """Yields the scans of a column without nulls."""
    # Number by number, reading would take four times as long.
    rows = pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], SCAN_TYPE)
    times, poses, ranges = (rows.field(name) for name in ("time_s", "sensor_pose", "ranges_m"))
    if times.null_count or poses.null_count or ranges.null_count:
        raise ValueError("scan: a field is missing")
    parts = zip(
        times.to_pylist(), _rows_of(poses, np.float64), _rows_of(ranges, np.float32), strict=True
    )
    for time_s, sensor_pose, ranges_m in parts:
        yield Scan(time_s, sensor_pose, angles_rad, ranges_m)


def _rows_of(lists: pa.ListArray, kind: type[Number]) -> Iterator[NDArray[Number]]:
    """Yields each list of numbers as an array."""
    values = lists.values.to_numpy(zero_copy_only=False).astype(kind, copy=False)
    offsets = lists.offsets.to_pylist()
    for first, last in pairwise(offsets):
        yield values[first:last]
