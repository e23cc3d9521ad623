"""The robot's estimate of its pose and velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, DiscreteValues, LeafSystem
from pydrake.systems.primitives import Adder

from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import STATE_SIZE


class Localization(Diagram):
    """The true state plus white noise that holds for one period; without noise, the truth itself.

    Input `state` and output `estimate` are [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] in the world
    frame. Abstract parameter `seed_parameter` holds the trial's seed. moves_sideways: whether the
    base moves sideways, so that vy is measured with noise. The noise is drawn at the start, at
    `offset_s` and once a period after that. Drake runs unrestricted updates before discrete ones,
    so systems that read the estimate in an unrestricted update of the initialization, as the
    navigators do, get the truth.
    """

    def __init__(
        self,
        settings: Timeline[LocalizationSettings],
        *,
        offset_s: float,
        moves_sideways: bool = False,
    ) -> None:
        super().__init__()
        builder = DiagramBuilder()
        noise = builder.AddNamedSystem(
            "noise", HeldNoise(settings, offset_s=offset_s, moves_sideways=moves_sideways)
        )
        self.seed_parameter = noise.seed_parameter
        truth_and_noise = builder.AddNamedSystem(
            "truth_and_noise", Adder(num_inputs=2, size=noise.get_output_port().size())
        )
        builder.Connect(noise.get_output_port(), truth_and_noise.get_input_port(1))
        builder.ExportInput(truth_and_noise.get_input_port(0), "state")
        builder.ExportOutput(truth_and_noise.get_output_port(), "estimate")
        builder.BuildInto(self)


class HeldNoise(LeafSystem):
    """White noise on [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] that holds for one period.

    Output `noise` is the discrete state, a function of the seed and the step alone. It is zero
    until the discrete updates of the initialization.
    """

    def __init__(
        self,
        settings: Timeline[LocalizationSettings],
        *,
        offset_s: float,
        moves_sideways: bool = False,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._period_s = settings.at(0.0).period_s
        self._offset_s = offset_s
        self._moves_sideways = moves_sideways
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        first = settings.at(0.0)
        # The settings at the last call, and their deviations.
        self._known = first, self._std(first)
        self._noise = self.DeclareDiscreteState(STATE_SIZE)
        self.DeclareStateOutputPort("noise", self._noise)
        if settings.any(lambda at_a_time: bool(self._std(at_a_time).any())):
            self.DeclareInitializationDiscreteUpdateEvent(weakly_bound(self._on_start))
            self.DeclarePeriodicDiscreteUpdateEvent(
                self._period_s, offset_s, weakly_bound(self._on_period)
            )

    def _on_start(self, context: Context, discrete_state: DiscreteValues) -> None:
        self._draw(context, discrete_state, step=0)

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        step = 1 + round((context.get_time() - self._offset_s) / self._period_s)
        self._draw(context, discrete_state, step=step)

    def _draw(self, context: Context, discrete_state: DiscreteValues, *, step: int) -> None:
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        generator = NoiseKey(seed, NoiseStream.LOCALIZATION, step).generator()
        settings = self._settings.at(context.get_time())
        if settings is not self._known[0]:
            self._known = settings, self._std(settings)
        std = self._known[1]
        discrete_state.set_value(self._noise, std * generator.standard_normal(std.size))

    def _std(self, settings: LocalizationSettings) -> NDArray[np.float64]:
        """Returns (6,) the standard deviations."""
        return np.array(
            [
                settings.xy_std_m,
                settings.xy_std_m,
                settings.yaw_std_rad,
                settings.linear_velocity_std_mps,
                settings.angular_velocity_std_radps,
                settings.linear_velocity_std_mps if self._moves_sideways else 0.0,
            ]
        )
