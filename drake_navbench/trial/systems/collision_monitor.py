"""The collision monitor: the last check of a command, by the sensors' points around the robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.collision_monitor import CollisionMonitor, MonitorState
from drake_navbench.navigation.monitor_shapes import CollisionMonitorParameters
from drake_navbench.navigation.monitor_sources import MonitorReadings, Mountings, points_of
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    COMMAND_SIZE,
    STATE_SIZE,
    declare_object_input,
    read_object,
    value_or_none,
)


class CollisionMonitorSystem(LeafSystem):
    """Nav2's collision monitor, as one update a command period, the first at `offset_s`.

    Inputs `command` [v m/s, w rad/s, vy m/s], `scan` (Scan or None), `ranges` (RangeReadings by the
    name of the sensor, the newest last; need not be connected) and `state` [x m, y m, yaw rad,
    ...], the odometry. Outputs `safe_command` [v m/s, w rad/s, vy m/s] and `monitor_state`
    (MonitorState).

    period_s: period of the commands; each command is checked once. footprint: (K, 2) padded, m.
    """

    def __init__(
        self,
        parameters: CollisionMonitorParameters,
        mountings: Mountings,
        *,
        footprint: NDArray[np.float64],
        period_s: float,
        offset_s: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._mountings = mountings
        self._monitor = CollisionMonitor(parameters, footprint)
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        self._scan_port = declare_object_input(self, "scan")
        self._ranges_port = declare_object_input(self, "ranges")
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._monitor_state = self.DeclareAbstractState(AbstractValue.Make(MonitorState()))
        self._output = self.DeclareDiscreteState(COMMAND_SIZE)
        self.DeclareStateOutputPort("safe_command", self._output)
        self.DeclareStateOutputPort("monitor_state", self._monitor_state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            period_s, offset_s, weakly_bound(self._on_command)
        )

    def _on_command(self, context: Context, state: State) -> None:
        before = context.get_abstract_state(self._monitor_state).get_value()
        after, output = self._monitor.step(
            before, self._command_port.Eval(context), self._points(context)
        )
        state.get_mutable_abstract_state(self._monitor_state).set_value(after)
        state.get_mutable_discrete_state(self._output).SetFromVector(output)

    def _points(self, context: Context) -> dict[str, NDArray[np.float64]] | None:
        """Returns each source's (N, 2) points, base frame, m; None where one stops the robot."""
        parameters = self._parameters
        scan: Scan | None = read_object(self._scan_port, context)
        ranges = value_or_none(self._ranges_port, context) or {}
        now = self._state_port.Eval(context)[:3] if parameters.base_shift_correction else None
        sensed = MonitorReadings(
            context.get_time(),
            now,
            None if scan is None else scan.placed_by_odometry(),
            {
                name: [one.placed_by_odometry() for one in readings]
                for name, readings in ranges.items()
            },
        )
        return points_of(
            parameters.observation_sources,
            parameters.source_timeout,
            self._mountings,
            sensed,
            release=parameters.nav2_release,
        )
