"""Keeps commands within limits on velocity and acceleration."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.navigation.velocity_smoother import (
    SmootherState,
    VelocitySmoother,
    VelocitySmootherParameters,
)
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE


class VelocitySmootherSystem(LeafSystem):
    """Nav2's velocity smoother, as one update a smoothing period, the first at `offset_s`.

    Inputs `command` [v m/s, w rad/s, vy m/s] and `estimate` [x m, y m, yaw rad, v m/s, w rad/s, vy
    m/s], whose velocity CLOSED_LOOP starts from (Nav2 takes a mean over odom_duration). Output
    `smoothed_command` [v m/s, w rad/s, vy m/s]. A command here is a signal that holds until it
    changes, not a message, so velocity_timeout never expires.
    """

    def __init__(self, parameters: VelocitySmootherParameters, *, offset_s: float) -> None:
        super().__init__()
        self._smoother = VelocitySmoother(parameters)
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self._state = self.DeclareAbstractState(AbstractValue.Make(SmootherState()))
        self._output = self.DeclareDiscreteState(COMMAND_SIZE)
        self.DeclareStateOutputPort("smoothed_command", self._output)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            parameters.period_s, offset_s, weakly_bound(self._on_period)
        )

    def _on_period(self, context: Context, state: State) -> None:
        before = context.get_abstract_state(self._state).get_value()
        after, output = self._smoother.step(
            before,
            self._command_port.Eval(context),
            measured=self._estimate_port.Eval(context)[3:],
        )
        state.get_mutable_abstract_state(self._state).set_value(after)
        state.get_mutable_discrete_state(self._output).SetFromVector(np.asarray(output))
