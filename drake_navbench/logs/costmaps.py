"""The local costmaps of a trial, and the column in which its log keeps them small.

A costmap is a few thousand bytes that mostly repeat those of the one before: a log's pages are
compressed, so that an update takes a few hundred bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from drake_navbench.kernels.grid import Costmap

# Column -> meaning, as for the columns of drake_navbench.logs.log. A log may be without them.
COSTMAP_COLUMNS: Mapping[str, str] = {
    "costmap": "a new local costmap: time of its update, lower left corner, edge of a cell, "
    "columns, whether it marks unseen cells, costs row by row from the lowest",
}

_TYPE = pa.struct(
    [
        ("time_s", pa.float64()),
        ("origin_x_m", pa.float64()),
        ("origin_y_m", pa.float64()),
        ("resolution_m", pa.float64()),
        ("columns", pa.int32()),
        ("tracks_unknown", pa.bool_()),
        ("costs", pa.binary()),
    ]
)


def costmap_columns(
    costmaps: Sequence[Costmap], rows: Sequence[int], row_count: int
) -> dict[str, pa.Array]:
    """Returns the column of a log table, none without costmaps; rows: the row of each costmap."""
    if not costmaps:
        return {}
    values: list[Mapping[str, object] | None] = [None] * row_count
    for costmap, row in zip(costmaps, rows, strict=True):
        values[row] = {
            "time_s": costmap.stamp_s,
            "origin_x_m": costmap.origin_x,
            "origin_y_m": costmap.origin_y,
            "resolution_m": costmap.resolution,
            "columns": costmap.costs.shape[1],
            "tracks_unknown": costmap.tracks_unknown,
            "costs": costmap.costs.tobytes(),
        }
    return {"costmap": pa.array(values, type=_TYPE)}


def read_costmaps(table: pa.Table) -> tuple[Costmap, ...]:
    """Returns the costmaps of a log table in order; none where the log has none.

    Raises ValueError where the costs of a costmap are no whole rows.
    """
    if "costmap" not in table.column_names:
        return ()
    return tuple(
        Costmap(
            costs=np.frombuffer(entry["costs"], dtype=np.uint8).reshape(-1, entry["columns"]),
            origin_x=entry["origin_x_m"],
            origin_y=entry["origin_y_m"],
            resolution=entry["resolution_m"],
            tracks_unknown=entry["tracks_unknown"],
            stamp_s=entry["time_s"],
        )
        for entry in table["costmap"].drop_null().to_pylist()
    )
