"""The lidar scans of a trial, and the column in which its log keeps them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drake_navbench.kernels.scan import Scan

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
