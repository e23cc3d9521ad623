"""One task cut out of a recording: samples, plans, scans and costmaps on the task's clock.

Signals that the recording lacks are noted in the caller's `missing`, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.log_columns import COLUMNS, LATERAL_COLUMNS, UNREPEATABLE_COLUMNS
from drake_navbench.logs.plans import Plan
from drake_navbench.ros2.recordings.decoded_messages import Beams, Cells, Poses
from drake_navbench.ros2.recordings.occupancy import costs_from_occupancy
from drake_navbench.ros2.recordings.planar_transforms import composed, inverted
from drake_navbench.ros2.recordings.recorded_columns import Column
from drake_navbench.ros2.recordings.recorded_motion import RecordedMotion
from drake_navbench.ros2.recordings.recorded_tasks import RecordedTask
from drake_navbench.ros2.recordings.topics import SCALAR_COLUMNS

POSE_COLUMNS = ("x_m", "y_m", "yaw_rad")
TWIST_COLUMNS = ("v_mps", "w_radps", "vy_mps")
ESTIMATE_COLUMNS = ("estimated_x_m", "estimated_y_m", "estimated_yaw_rad")
# The least z of a scanner's upward axis: a scanner that leans more does not scan the plane.
LEAST_UPRIGHT = 0.9
# A costmap turned by less than this in the world lies along the world's axes.
TURN_TOLERANCE_RAD = 1e-6
# The most bytes of a task's local costmaps, uncompressed; beyond it every second one is kept.
MAX_COSTMAP_BYTES = 40_000_000
# The request of a goal may come this long before or after the goal's state says that it is worked
# on, s.
GOAL_LEAD_S = 1.0


class RecordedPiece:
    """The piece of a recording that makes one task, on the task's own clock."""

    def __init__(
        self, columns: Mapping[str, Column], motion: RecordedMotion, task: RecordedTask
    ) -> None:
        self._columns, self._motion, self.task = columns, motion, task
        times = motion.time_s
        first = int(np.searchsorted(times, task.begin_s, side="left"))
        # One sample behind the end shows the end's effect.
        past = int(np.searchsorted(times, task.end_s, side="right")) + 1
        self._rows = slice(first, past)
        self._stamps = times[self._rows]
        self.time_s = self._stamps - task.begin_s
        self.scanner_place: list[float] | None = None

    def samples(
        self, distances: Mapping[str, Array], missing: dict[str, str], *, moves_sideways: bool
    ) -> pd.DataFrame:
        """Returns the rows of the log; unknown values are NaN."""
        motion, rows = self._motion, self._rows
        values: dict[str, Any] = {"time_s": self.time_s}
        values |= zip(POSE_COLUMNS, motion.pose[rows].T, strict=True)
        values |= zip(ESTIMATE_COLUMNS, motion.estimated_pose[rows].T, strict=True)
        values |= zip(TWIST_COLUMNS, motion.twist[rows].T, strict=True)
        measured = [f"measured_{name}" for name in TWIST_COLUMNS]
        values |= zip(measured, motion.measured_twist[rows].T, strict=True)
        commands = self._held("command", np.zeros(len(TWIST_COLUMNS)))
        names = [*COLUMNS, *(LATERAL_COLUMNS if moves_sideways else ())]
        for index, name in enumerate(f"command_{name}" for name in TWIST_COLUMNS):
            if commands is None and name in names:
                missing[name] = "the recording has no commands"
            values[name] = self._unknown if commands is None else commands[:, index]
        for name in SCALAR_COLUMNS:
            held = self._held(name, np.array([math.nan]))
            if held is not None:
                values[name] = held[:, 0]
            elif name in distances:
                values[name] = distances[name]
            else:
                values[name] = self._unknown
                missing[name] = _why_missing(name)
        if "cycle_count" in missing:
            values["cycle_count"] = np.zeros(len(self.time_s))
        values["cycle_count"] = np.nan_to_num(values["cycle_count"]).astype(np.int64)
        return pd.DataFrame({name: np.ascontiguousarray(values[name]) for name in names})

    def plans(self, missing: dict[str, str]) -> list[Plan]:
        """Returns the plans of the task in the frame of its poses."""
        column = self._columns.get("plan")
        if column is None or not column.values:
            missing["plan"] = "the recording has no plan"
            return []
        times = self._motion.clock.times(column)
        task = self.task
        chosen = np.flatnonzero((times >= task.begin_s) & (times <= task.end_s))
        if not len(chosen):
            chosen = np.flatnonzero(times < task.begin_s)[-1:]
        plans = []
        for row in chosen:
            path: Poses = column.values[row]
            place = self._motion.in_world(path.frame, times[row : row + 1])
            if place is None:
                missing["plan"] = (
                    f"the plans are in the frame {path.frame}, which no transform joins to "
                    f"{self._motion.world}"
                )
                return []
            if len(path.poses):
                poses = composed(np.broadcast_to(place[0], path.poses.shape), path.poses)
                plans.append(Plan(max(0.0, float(times[row]) - task.begin_s), poses))
        return plans

    def goal(self, plans: Sequence[Plan], missing: dict[str, str]) -> Array:
        """Returns the goal (3,): the end of the last plan, else the goal that was requested."""
        if plans:
            return plans[-1].poses[-1]
        column = self._columns.get("goal")
        if column is not None and column.values:
            times = self._motion.clock.times(column)
            rows = np.flatnonzero(times <= self.task.begin_s + GOAL_LEAD_S)
            if len(rows):
                goals: Poses = column.values[rows[-1]]
                place = self._motion.in_world(goals.frame, times[rows[-1:]])
                if place is not None:
                    return composed(place[0], goals.poses[0])
        missing["goal"] = "the recording has neither a plan nor a goal"
        return self._motion.pose[self._rows][-1]

    def scans(self, missing: dict[str, str]) -> tuple[Scan, ...]:
        """Returns the scans with the sensor's poses, all resampled to the first scan's angles."""
        column = self._columns.get("scan")
        rows = self._rows_within("scan")
        if column is None or not len(rows):
            missing["scan"] = "the recording has no scan"
            return ()
        first: Beams = column.values[rows[0]]
        mounting = self._motion.mounting(first.frame)
        if mounting is None:
            missing["scan"] = f"no fixed transform gives the pose of {first.frame} on the robot"
            return ()
        upright = float(mounting.rotation[2, 2])
        if abs(upright) < LEAST_UPRIGHT:
            missing["scan"] = f"{first.frame} is tilted: its scans are not horizontal"
            return ()
        self.scanner_place = [float(value) for value in mounting.pose]
        # An upside-down scanner counts its beams the other way round.
        side = 1.0 if upright > 0.0 else -1.0
        times = self._motion.clock.times(column)[rows]
        places = composed(self._motion.track.at(times), np.tile(mounting.pose, (len(times), 1)))
        beams: Array = first.angle_min + first.increment * np.arange(
            len(first.ranges_m), dtype=np.float64
        )
        return tuple(
            Scan(
                float(time_s - self.task.begin_s),
                np.ascontiguousarray(place),
                side * beams,
                _on_beams(column.values[row], beams),
            )
            for row, time_s, place in zip(rows, times, places, strict=True)
        )

    def costmaps(self, missing: dict[str, str]) -> tuple[tuple[Costmap, ...], dict[str, Array]]:
        """Returns the local costmaps, and by column the distances to their lethal cells.

        The distances are those that a trial logs: (N,) from the robot's reference point to the
        centre, and to the lower left corner, of the nearest lethal cell of the costmap at the time.
        """
        column = self._columns.get("costmap")
        rows = self._rows_within("costmap")
        if column is None or not len(rows):
            return (), {}
        frame = column.values[rows[0]].frame
        seen = self._motion.base_in(frame, self._stamps)
        if seen is None:
            missing["costmap"] = f"no transform gives the robot's pose in {frame}"
            return (), {}
        times = self._motion.clock.times(column)[rows]
        places = self._motion.in_world(frame, times)
        size = int(np.prod(column.values[rows[0]].shape))
        stride = max(1, -(-size * len(rows) // MAX_COSTMAP_BYTES))
        nearest = {
            name: np.full(len(self._stamps), np.inf)
            for name in ("obstacle_cell_distance_m", "obstacle_corner_distance_m")
        }
        kept = []
        until = [*times[1:], np.inf]
        for count, (row, time_s) in enumerate(zip(rows, times, strict=True)):
            cells: Cells = column.values[row]
            costs = costs_from_occupancy(cells.occupancy)
            held = (self._stamps >= time_s) & (self._stamps < until[count])
            _note_distances(nearest, held, seen, cells, costs)
            if count % stride == 0 and places is not None:
                stamp_s = float(time_s - self.task.begin_s)
                kept.append(_placed(cells, costs, places[count], stamp_s))
        return tuple(kept), nearest

    @property
    def _unknown(self) -> Array:
        return np.full(len(self.time_s), math.nan)

    def _rows_within(self, role: str) -> NDArray[np.int64]:
        """Returns the messages of a role in this piece."""
        column = self._columns.get(role)
        if column is None or not column.values:
            return np.empty(0, dtype=np.int64)
        times = self._motion.clock.times(column)
        return np.flatnonzero((times >= self.task.begin_s) & (times <= self._stamps[-1]))

    def _held(self, role: str, before: Array) -> Array | None:
        """Returns the last value of a role at each sample, (N, K); None without any value.

        before: (K,) the value that holds before the first message.
        """
        column = self._columns.get(role)
        if column is None or not column.values:
            return None
        times = self._motion.clock.times(column)
        order = np.argsort(times, kind="stable")
        values = np.array(column.values, dtype=float).reshape(len(times), -1)[order]
        last = np.searchsorted(times[order], self._stamps, side="right") - 1
        return np.where(last[:, None] >= 0, values[np.maximum(last, 0)], before)


def _why_missing(column: str) -> str:
    if column in ("cycle_count", *UNREPEATABLE_COLUMNS):
        return "a recording does not contain the controller's compute times"
    if column == "clearance_m":
        return (
            "a recording does not contain the true positions of all obstacles; see "
            "min_scan_clearance_m and min_map_clearance_m"
        )
    return "the recording has no local costmap"


def _on_beams(beams: Beams, angles_rad: Array) -> NDArray[np.float32]:
    """Returns the ranges of a scan at other angles, as the angles of some scanners vary."""
    own = beams.angle_min + beams.increment * np.arange(len(beams.ranges_m))
    if len(own) == len(angles_rad) and np.allclose(own, angles_rad, atol=1e-6):
        return beams.ranges_m
    if len(own) == 0:
        return np.full(len(angles_rad), np.inf, dtype=np.float32)
    if beams.increment == 0.0:
        return np.full(len(angles_rad), beams.ranges_m[0], dtype=np.float32)
    nearest = np.rint((angles_rad - beams.angle_min) / beams.increment).astype(int)
    is_seen = (nearest >= 0) & (nearest < len(own))
    ranges = beams.ranges_m[np.clip(nearest, 0, len(own) - 1)]
    return np.where(is_seen, ranges, np.float32(np.inf)).astype(np.float32)


def _note_distances(
    nearest: Mapping[str, Array],
    held: NDArray[np.bool_],
    seen: Array,
    cells: Cells,
    costs: NDArray[np.uint8],
) -> None:
    """Fills in the distances at the samples at which a costmap held."""
    rows, columns = np.divmod(np.flatnonzero(costs == LETHAL), costs.shape[1])
    if not len(rows) or not held.any():
        return
    # Distances are computed in the grid's own frame, which may be turned in the world.
    own = composed(inverted(np.array(cells.origin)), seen[held])[:, :2]
    for name, offset in (("obstacle_cell_distance_m", 0.5), ("obstacle_corner_distance_m", 0.0)):
        x, y = (columns + offset) * cells.resolution, (rows + offset) * cells.resolution
        gaps = np.hypot(own[:, :1] - x, own[:, 1:] - y)
        nearest[name][held] = gaps.min(axis=1)


def _placed(cells: Cells, costs: NDArray[np.uint8], place: Array, stamp_s: float) -> Costmap:
    """Returns a costmap on a grid along the world's axes.

    place: (3,) pose of the costmap's frame in the world.
    """
    origin = composed(place, np.array(cells.origin))
    turn = math.remainder(float(origin[2]), 2.0 * math.pi)
    x, y = float(origin[0]), float(origin[1])
    if abs(turn) > TURN_TOLERANCE_RAD:
        costs, x, y = _turned(costs, cells.resolution, origin)
    return Costmap(costs, x, y, cells.resolution, stamp_s=stamp_s)


def _turned(
    costs: NDArray[np.uint8], resolution: float, origin: Array
) -> tuple[NDArray[np.uint8], float, float]:
    """Returns a turned grid as one of the same size along the axes: each cell takes the nearest."""
    rows, columns = costs.shape
    half = 0.5 * resolution * np.array([columns, rows])
    middle = composed(origin, np.array([*half, 0.0]))[:2]
    low = middle - half
    y, x = np.mgrid[0:rows, 0:columns]
    centres = np.stack(
        [low[0] + (x + 0.5) * resolution, low[1] + (y + 0.5) * resolution, np.zeros(x.shape)],
        axis=-1,
    )
    own = composed(np.broadcast_to(inverted(origin), centres.shape), centres)
    column = np.floor(own[..., 0] / resolution).astype(int)
    row = np.floor(own[..., 1] / resolution).astype(int)
    is_inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = costs[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
    return np.where(is_inside, found, 0).astype(np.uint8), float(low[0]), float(low[1])
