"""The global plans of a trial, and the columns in which its log keeps many of them small.

A navigator that plans anew once a second leaves hundreds of plans, each as long as the rest of the
course. The first plan of a leg is kept exactly, since lengths and scores are computed from it. The
other plans are rounded to a micrometre and kept as integers: these differ little from pose to pose,
and take a tenth of the space.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.immutable import Immutable

POSITIONS_PER_METRE = 1e6
HEADINGS_PER_RADIAN = 1e4
_UNITS = np.array([POSITIONS_PER_METRE, POSITIONS_PER_METRE, HEADINGS_PER_RADIAN])
_EXACT_FIELDS = ("x_m", "y_m", "yaw_rad")
_ROUNDED_FIELDS = ("x_um", "y_um", "yaw_100urad")

# Column -> meaning, as for the columns of drake_navbench.logs.log.
PLAN_COLUMNS: Mapping[str, str] = {
    "first_plans": "first plans of a leg that the controller server was given since the sample "
    "before: time, leg counted from 0, poses in the world frame",
    "replans": "likewise every later plan of a leg that differs from the one before it: positions "
    "in micrometres, headings in units of 1e-4 rad",
}


@dataclass(frozen=True, eq=False)
class Plan(Immutable):
    """A global plan, in force from its arrival at the controller server until the next plan's.

    time_s: the time of its arrival. poses: (N, 3) x m, y m, yaw rad. leg: the number, from 0, of
    the goal that it leads to; a trial without waypoints has one leg, and so has one in the mode
    navigate_through_poses, whose plans lead through all poses that are left.
    """

    time_s: float
    poses: Array
    leg: int = 0


def as_logged(plans: Iterable[Plan]) -> tuple[Plan, ...]:
    """Returns the plans that a log keeps of those given to the controller server, in order.

    A plan equal to the one before it in its leg is left out. All but the first of a leg are
    rounded, so that results before and after writing a log are the same.
    """
    kept: list[Plan] = []
    before: Plan | None = None
    for plan in plans:
        if before is None or before.leg != plan.leg:
            kept.append(plan)
        elif not np.array_equal(before.poses, plan.poses):
            kept.append(replace(plan, poses=_from_whole(_as_whole(plan.poses))))
        before = plan
    return tuple(kept)


def first_of_each_leg(plans: Iterable[Plan]) -> tuple[Plan, ...]:
    """Returns the first plan of every leg that has any."""
    first: dict[int, Plan] = {}
    for plan in plans:
        first.setdefault(plan.leg, plan)
    return tuple(first.values())


def plan_columns(plans: Sequence[Plan], rows: Sequence[int], row_count: int) -> dict[str, pa.Array]:
    """Returns the columns of a log table; rows: the row of each plan. See `PLAN_COLUMNS`."""
    columns: dict[str, list[list[Any] | None]] = {name: [None] * row_count for name in PLAN_COLUMNS}
    legs: set[int] = set()
    poses: NDArray[Any]
    for plan, row in zip(plans, rows, strict=True):
        if plan.leg in legs:
            name, fields, poses = "replans", _ROUNDED_FIELDS, _as_whole(plan.poses)
        else:
            name, fields, poses = "first_plans", _EXACT_FIELDS, plan.poses
        legs.add(plan.leg)
        entry = {"time_s": plan.time_s, "leg": plan.leg} | dict(zip(fields, poses.T, strict=True))
        columns[name][row] = [*(columns[name][row] or []), entry]
    return {name: pa.array(values, type=_TYPES[name]) for name, values in columns.items()}


def read_plans(table: pa.Table) -> tuple[Plan, ...]:
    """Returns the plans in a log's columns, in order of their times."""
    first = [
        Plan(entry["time_s"].as_py(), _poses(entry, _EXACT_FIELDS), entry["leg"].as_py())
        for entry in _entries(table["first_plans"])
    ]
    later = [
        Plan(
            entry["time_s"].as_py(),
            _from_whole(_poses(entry, _ROUNDED_FIELDS)),
            entry["leg"].as_py(),
        )
        for entry in _entries(table["replans"])
    ]
    return tuple(sorted(first + later, key=lambda plan: (plan.leg, plan.time_s)))


def _as_whole(poses: Array) -> NDArray[np.int64]:
    return np.round(poses * _UNITS).astype(np.int64)


def _from_whole(poses: NDArray[np.int64]) -> Array:
    return poses / _UNITS


def _entries(column: pa.ChunkedArray) -> Iterable[pa.StructScalar]:
    for chunk in column.chunks:
        yield from chunk.flatten()


def _poses(entry: pa.StructScalar, fields: Sequence[str]) -> NDArray[Any]:
    return np.column_stack([entry[name].values.to_numpy() for name in fields])


def _plan_type(fields: Sequence[str], number: pa.DataType) -> pa.DataType:
    poses = [(name, pa.list_(number)) for name in fields]
    return pa.list_(pa.struct([("time_s", pa.float64()), ("leg", pa.int32()), *poses]))


_TYPES = {
    "first_plans": _plan_type(_EXACT_FIELDS, pa.float64()),
    "replans": _plan_type(_ROUNDED_FIELDS, pa.int64()),
}
# Parquet's encodings for numbers that differ little from one to the next, by path of the leaf.
PLAN_ENCODINGS: Mapping[str, str] = {
    f"first_plans.list.element.{name}.list.element": "BYTE_STREAM_SPLIT" for name in _EXACT_FIELDS
} | {f"replans.list.element.{name}.list.element": "DELTA_BINARY_PACKED" for name in _ROUNDED_FIELDS}
