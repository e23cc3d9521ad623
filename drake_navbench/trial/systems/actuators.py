"""Wheels that obey commands imperfectly: slip, a deadband, steps of speed, unequal radii."""

from __future__ import annotations

import math

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from drake_navbench.inputs.actuators import GRAVITY_MPS2, ActuatorSettings
from drake_navbench.inputs.drive import MotionBounds
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.wheels import obeyed
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE

# A velocity: v m/s, w rad/s and vy m/s.
Velocity = list[float]
# Every control cycle of 20 Hz falls on a step.
FORCE_PERIOD_S = 0.025
SLIP_PERIOD_S = 0.1
MAX_SLIP = 0.95
WHEELS = 2


class SlippingWheels(LeafSystem):
    """Deadband, steps, unequal radii and slip of the wheels of a differential base.

    Input `command` and output `obeyed` [v m/s, w rad/s, vy m/s]; output `gains` (2,), for the left
    and the right wheel its speed over the floor divided by its turn rate times the nominal radius.
    Abstract parameter `seed_parameter` holds the trial's seed; noise of the slip is drawn once in
    0.1 s.
    """

    def __init__(self, settings: Timeline[ActuatorSettings]) -> None:
        super().__init__()
        self._settings = settings
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        self._noise = self.DeclareDiscreteState(WHEELS)
        tickets = {self.discrete_state_ticket(self._noise)}
        if len(settings.settings) > 1:
            tickets.add(self.time_ticket())
        self.DeclareVectorOutputPort(
            "gains", WHEELS, weakly_bound(self._calc_gains), prerequisites_of_calc=tickets
        )
        tickets = tickets | {self.input_port_ticket(self._command_port.get_index())}
        self.DeclareVectorOutputPort(
            "obeyed", COMMAND_SIZE, weakly_bound(self._calc_obeyed), prerequisites_of_calc=tickets
        )
        if settings.any(lambda at_a_time: at_a_time.slip_std > 0.0):
            self.DeclarePeriodicDiscreteUpdateEvent(SLIP_PERIOD_S, 0.0, weakly_bound(self._on_slip))

    def _on_slip(self, context: Context, discrete_state: DiscreteValues) -> None:
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round(context.get_time() / SLIP_PERIOD_S)
        noise = NoiseKey(seed, NoiseStream.WHEELS, step).generator().standard_normal(2)
        discrete_state.get_mutable_vector(self._noise).SetFromVector(noise)

    def _calc_obeyed(self, context: Context, output: BasicVector) -> None:
        settings = self._settings.at(context.get_time())
        v, w, vy = self._command_port.Eval(context).tolist()
        v, w = obeyed(
            v,
            w,
            settings.wheel_separation_m,
            settings.deadband_mps,
            settings.speed_step_mps,
            *self._gains(context, settings),
        )
        output.SetFromVector(np.array([v, w, vy]))

    def _calc_gains(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._gains(context, self._settings.at(context.get_time())))

    def _gains(self, context: Context, settings: ActuatorSettings) -> tuple[float, float]:
        noise = context.get_discrete_state(self._noise).value()
        left_slip, right_slip = np.clip(settings.slip + settings.slip_std * noise, 0.0, MAX_SLIP)
        radius_share = 0.5 * settings.radius_difference
        return (1.0 + radius_share) * (1.0 - left_slip), (1.0 - radius_share) * (1.0 - right_slip)


class LimitedForce(LeafSystem):
    """Motors with a largest force, which limits how fast their speed follows the command.

    Inputs `command` [v m/s, w rad/s, vy m/s] and `state` [x m, y m, yaw rad, ...]; output `reached`
    [v m/s, w rad/s, vy m/s], one step every 0.025 s from `offset_s` on.

    With force F, mass m and payload p, a speed changes by at most a = F / (m + p) a second, the yaw
    rate by its limit times m / (m + p); a slope pulls back with g sin(slope) along its direction,
    which acts on a lateral speed, too. Where the pull is stronger than the motors, the robot rolls
    downhill.

    mass_kg: the robot's without payload. bounds: the bounds of the drive.
    """

    def __init__(
        self,
        settings: Timeline[ActuatorSettings],
        *,
        mass_kg: float,
        bounds: MotionBounds,
        offset_s: float,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._mass_kg = mass_kg
        self._bounds = bounds
        self._command_port = self.DeclareVectorInputPort("command", COMMAND_SIZE)
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        self._reached = self.DeclareDiscreteState(COMMAND_SIZE)
        self.DeclareStateOutputPort("reached", self._reached)
        self.DeclarePeriodicDiscreteUpdateEvent(
            FORCE_PERIOD_S, offset_s, weakly_bound(self._on_step)
        )

    def _on_step(self, context: Context, discrete_state: DiscreteValues) -> None:
        settings = self._settings.at(context.get_time())
        command = self._command_port.Eval(context).tolist()
        reached = context.get_discrete_state(self._reached).value().tolist()
        yaw = float(self._state_port.Eval(context)[2])
        stepped = self._stepped(settings, command, reached, yaw)
        discrete_state.get_mutable_vector(self._reached).SetFromVector(stepped)

    def _stepped(
        self, settings: ActuatorSettings, command: Velocity, reached: Velocity, yaw: float
    ) -> Velocity:
        loaded_kg = self._mass_kg + settings.payload_kg
        acceleration = self._bounds.acceleration_mps2
        if settings.force_n is not None:
            acceleration = settings.force_n / self._mass_kg
        acceleration *= self._mass_kg / loaded_kg
        yaw_acceleration = self._bounds.yaw_acceleration_radps2 * self._mass_kg / loaded_kg
        pull = GRAVITY_MPS2 * math.sin(settings.slope_rad)
        uphill = settings.slope_direction_rad - yaw
        # A robot that does not drive sideways is held by its wheels in that direction.
        holds = command[2] == 0.0 and reached[2] == 0.0
        pulls = (-pull * math.cos(uphill), 0.0, 0.0 if holds else -pull * math.sin(uphill))
        limits = (acceleration, yaw_acceleration, acceleration)
        stepped = []
        for wanted, speed, pulled, limit in zip(command, reached, pulls, limits, strict=True):
            low = speed + (pulled - limit) * FORCE_PERIOD_S
            high = speed + (pulled + limit) * FORCE_PERIOD_S
            stepped.append(min(max(wanted, low), high))
        return stepped
