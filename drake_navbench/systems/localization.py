"""What the robot believes about its pose and velocity."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.robot import LocalizationSettings


class Localization(LeafSystem):
    """The true state plus white noise that holds for one period; without noise, the truth itself.

    Input `state` and output `estimate` are [x m, y m, yaw rad, v m/s, w rad/s] in the world frame.
    Abstract parameter `seed_parameter` holds the trial's seed; the discrete state is the present
    noise, a function of seed and step alone. It changes at `offset_s` and once a period after that.
    """

    def __init__(self, settings: LocalizationSettings, *, offset_s: float) -> None:
        super().__init__()
        self._period_s = settings.period_s
        self._offset_s = offset_s
        self._std = np.array(
            [
                settings.xy_std_m,
                settings.xy_std_m,
                settings.yaw_std_rad,
                settings.linear_velocity_std_mps,
                settings.angular_velocity_std_radps,
            ]
        )
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._noise = self.DeclareDiscreteState(self._std.size)
        self._state_port = self.DeclareVectorInputPort("state", self._std.size)
        self.DeclareVectorOutputPort(
            "estimate",
            self._std.size,
            self._calc_estimate,
            prerequisites_of_calc={
                self.input_port_ticket(self._state_port.get_index()),
                self.xd_ticket(),
            },
        )
        if self._std.any():
            self.DeclareInitializationDiscreteUpdateEvent(self._on_start)
            self.DeclarePeriodicDiscreteUpdateEvent(settings.period_s, offset_s, self._on_period)

    def _on_start(self, context: Context, discrete_state: DiscreteValues) -> None:
        self._draw(context, discrete_state, step=0)

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        step = 1 + round((context.get_time() - self._offset_s) / self._period_s)
        self._draw(context, discrete_state, step=step)

    def _draw(self, context: Context, discrete_state: DiscreteValues, *, step: int) -> None:
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        generator = NoiseKey(seed, NoiseStream.LOCALIZATION, step).generator()
        noise = self._std * generator.standard_normal(self._std.size)
        discrete_state.get_mutable_vector(self._noise).SetFromVector(noise)

    def _calc_estimate(self, context: Context, output: BasicVector) -> None:
        noise = context.get_discrete_state(self._noise).value()
        output.SetFromVector(self._state_port.Eval(context) + noise)
