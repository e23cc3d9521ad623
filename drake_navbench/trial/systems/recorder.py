"""Keeps every signal of a trial on one clock."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, ValueProducer

from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.poses import place_point
from drake_navbench.kernels.scan import Scan
from drake_navbench.logs.log_columns import ODOMETRY_COLUMNS
from drake_navbench.trial.systems.clearance import DISTANCE_COUNT
from drake_navbench.trial.systems.diagnostics import (
    ARRAY_PERIOD_S,
    is_array,
    with_thinned_arrays,
    without_arrays,
)
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    COMMAND_SIZE,
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    read_object,
    value_or_none,
)

# The period at which the people's places are kept, and by how much the clock may fall short of it,
# s.
PEOPLE_PERIOD_S, ROUNDING_S = 0.1, 1e-6
# The sizes of the parts of the input `signals`: state, estimate, command and distances.
SIGNAL_SIZES = (STATE_SIZE, STATE_SIZE, COMMAND_SIZE, DISTANCE_COUNT)
_VELOCITY = ("v_mps", "w_radps", "vy_mps")
# The columns of a sample of every robot; the log of some robots has others between them.
RECORDED_COLUMNS = (
    *("time_s", "x_m", "y_m", "yaw_rad", *_VELOCITY),
    *("estimated_x_m", "estimated_y_m", "estimated_yaw_rad"),
    *(f"measured_{name}" for name in _VELOCITY),
    *(f"command_{name}" for name in _VELOCITY),
    *("clearance_m", "obstacle_cell_distance_m", "obstacle_corner_distance_m"),
    *("cycle_count", "compute_time_ms", "compute_cpu_time_ms"),
)


@dataclass
class Recording:
    """The samples recorded so far; they live in the recorder's Context, like Drake's VectorLog.

    rows: the pieces of each sample, in the order of `RECORDED_COLUMNS`, and after them the pose of
        the world in the odometry's frame, where the odometry has one.
    costmaps: every update of the local costmap that a sample saw. people: their poses (P, 3), x m,
        y m, yaw rad, ten times a second.
    noted_cycle: the last control cycle whose diagnostics were kept. arrays_due_s: time from
    which their arrays are kept again, s.
    """

    rows: list[tuple[float | np.ndarray, ...]] = field(default_factory=list)
    scans: list[Scan] = field(default_factory=list)
    diagnostics: list[tuple[float, Mapping[str, Any]]] = field(default_factory=list)
    events: list[tuple[float, dict[str, Any]]] = field(default_factory=list)
    costmaps: list[Costmap] = field(default_factory=list)
    people: list[tuple[float, np.ndarray]] = field(default_factory=list)
    noted_cycle: int = 0
    arrays_due_s: float = 0.0

    def note(self, time_s: float, cycle: int, diagnostics: Mapping[str, Any]) -> None:
        """Keeps a control cycle's diagnostics, unless they were noted before."""
        if cycle == self.noted_cycle:
            return
        self.noted_cycle = cycle
        if not diagnostics:
            return
        if not any(map(is_array, diagnostics.values())):
            self.diagnostics.append((time_s, diagnostics))
        elif time_s >= self.arrays_due_s:
            self.arrays_due_s = time_s + ARRAY_PERIOD_S
            self.diagnostics.append((time_s, with_thinned_arrays(diagnostics)))
        else:
            self.diagnostics.append((time_s, without_arrays(diagnostics)))

    def add_events(self, latest: Sequence[tuple[float, dict[str, Any]]]) -> None:
        """Adds the events that are newer than all recorded ones."""
        newest_s = self.events[-1][0] if self.events else -math.inf
        self.events.extend(event for event in latest if event[0] > newest_s)

    def wants_people(self, time_s: float) -> bool:
        """Returns whether people are due to be recorded; drops a record of the same time."""
        if self.people and self.people[-1][0] == time_s:
            self.people.pop()
        due_s = self.people[-1][0] + PEOPLE_PERIOD_S if self.people else -math.inf
        return time_s >= due_s - ROUNDING_S

    def forget_after(self, time_s: float) -> None:
        """Drops the samples after a time.

        Diagnostics of later times stay, but with the time `time_s`.
        """
        while self.rows and self.rows[-1][0] > time_s:
            self.rows.pop()
        self.diagnostics = [(min(noted_s, time_s), left) for noted_s, left in self.diagnostics]
        self.costmaps = [costmap for costmap in self.costmaps if costmap.stamp_s <= time_s]
        self.people = [entry for entry in self.people if entry[0] <= time_s]

    def columns(self) -> dict[str, np.ndarray]:
        """Returns the samples by column."""
        if not self.rows:
            return {name: np.empty(0) for name in RECORDED_COLUMNS}
        table = np.column_stack([np.array(piece) for piece in zip(*self.rows, strict=True)])
        count = len(RECORDED_COLUMNS)
        columns = dict(zip(RECORDED_COLUMNS, table[:, :count].T, strict=True))
        if table.shape[1] == count:
            return columns
        x, y, yaw = (columns[name] for name in ("x_m", "y_m", "yaw_rad"))
        frame_x, frame_y, frame_yaw = table[:, count:].T
        x, y = place_point(x, y, frame_x, frame_y, np.cos(frame_yaw), np.sin(frame_yaw))
        return columns | dict(zip(ODOMETRY_COLUMNS, (x, y, yaw + frame_yaw), strict=True))


class Recorder(LeafSystem):
    """Samples all signals once a period, before the updates that are due at the same time.

    Input `signals`, one after the other: the state and its estimate [x m, y m, yaw rad, v m/s,
    w rad/s, vy m/s], the command [v m/s, w rad/s, vy m/s], the distances [m] (see Clearance).
    Inputs `odometry_from_world` (3,), the pose of the world in the odometry frame (need not be
    connected), `server_state` (ServerState), `scan` (Scan or None), `navigator_state`
    (NavigatorState; need not be connected), whose events are kept, `costmap` (Costmap or None; need
    not be connected), and where there are people `people` [x m, y m, yaw rad] of each.
    """

    def __init__(self, *, period_s: float, person_count: int = 0) -> None:
        super().__init__()
        self._people_port = None
        if person_count:
            size = POSE_SIZE * person_count
            self._people_port = self.DeclareVectorInputPort("people", size)
        self._recording = self.DeclareCacheEntry(
            "recording",
            ValueProducer(lambda: AbstractValue.Make(Recording()), ValueProducer.NoopCalc),
            {self.nothing_ticket()},
        )
        self._signals_port = self.DeclareVectorInputPort("signals", sum(SIGNAL_SIZES))
        self._frame_port = self.DeclareVectorInputPort("odometry_from_world", POSE_SIZE)
        self._server_port = declare_object_input(self, "server_state")
        self._scan_port = declare_object_input(self, "scan")
        self._navigator_port = declare_object_input(self, "navigator_state")
        self._costmap_port = declare_object_input(self, "costmap")
        self.DeclarePeriodicPublishEvent(period_s, 0.0, weakly_bound(self.record))
        self.DeclareForcedPublishEvent(weakly_bound(self.record))

    def find_recording(self, context: Context) -> Recording:
        """Returns the recording in this system's context."""
        return self._recording.Eval(context)

    def record(self, context: Context) -> None:
        """Takes one sample; a time already sampled is replaced."""
        recording = self._recording.Eval(context)
        time_s = context.get_time()
        server = read_object(self._server_port, context)
        row: tuple[float | np.ndarray, ...] = (
            time_s,
            self._signals_port.Eval(context),
            float(server.cycle_count),
            server.compute_time_ms,
            server.compute_cpu_time_ms,
        )
        frame = value_or_none(self._frame_port, context)
        if frame is not None:
            row = (*row, frame)
        if recording.rows and recording.rows[-1][0] == time_s:
            recording.rows.pop()
        recording.rows.append(row)
        if self._people_port is not None and recording.wants_people(time_s):
            poses = self._people_port.Eval(context).reshape(-1, POSE_SIZE)
            recording.people.append((time_s, poses))
        scan = read_object(self._scan_port, context)
        if scan is not None and (not recording.scans or recording.scans[-1] is not scan):
            recording.scans.append(scan)
        recording.note(time_s, server.cycle_count, server.diagnostics)
        navigator = value_or_none(self._navigator_port, context)
        if navigator is not None:
            recording.add_events(navigator.events)
        costmap = value_or_none(self._costmap_port, context)
        if costmap is not None and (
            not recording.costmaps or recording.costmaps[-1] is not costmap
        ):
            recording.costmaps.append(costmap)
