"""The viewer, which shows a trial while it runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import Context, LeafSystem

from drake_navbench.logs.moment import Moment
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    read_object,
    value_or_none,
)


class Viewer(LeafSystem):
    """Calls a function with every Moment, once a period.

    Inputs `state`, `scan`, `costmap` (need not be connected), `plan` and `server_state`, as the
    recorder's and the controller server's, `odometry_from_world` (3,), the pose of the world in the
    odometry frame (need not be connected), and, where anything moves, `moving_poses` [x m, y m, yaw
    rad] of each body. The period should be the recorder's: at any other instant the integrator's
    steps would end there too, and the motion would differ in its last digits.
    """

    def __init__(
        self, show: Callable[[Moment], None], *, period_s: float, moving_count: int = 0
    ) -> None:
        super().__init__()
        self._show = show
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._scan_port = declare_object_input(self, "scan")
        self._costmap_port = declare_object_input(self, "costmap")
        self._plan_port = declare_object_input(self, "plan")
        self._server_port = declare_object_input(self, "server_state")
        self._frame_port = self.DeclareVectorInputPort("odometry_from_world", POSE_SIZE)
        self._moving_port = None
        if moving_count:
            size = POSE_SIZE * moving_count
            self._moving_port = self.DeclareVectorInputPort("moving_poses", size)
        self.DeclarePeriodicPublishEvent(period_s, 0.0, weakly_bound(self._on_period))

    def _on_period(self, context: Context) -> None:
        plan = read_object(self._plan_port, context)
        moving = () if self._moving_port is None else self._moving_port.Eval(context)
        self._show(
            Moment(
                context.get_time(),
                self._state_port.Eval(context),
                read_object(self._scan_port, context),
                value_or_none(self._costmap_port, context),
                None if plan is None else plan.poses,
                read_object(self._server_port, context).diagnostics,
                np.reshape(moving, (-1, POSE_SIZE)),
                value_or_none(self._frame_port, context),
            )
        )
