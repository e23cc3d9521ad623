"""Motors of limited force, in numbers to be checked by hand."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.inputs.actuators import GRAVITY_MPS2, ActuatorSettings
from drake_navbench.inputs.drive import MotionBounds
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.trial.systems.actuators import LimitedForce, SlippingWheels

BOUNDS = MotionBounds(1.0, 2.0, 2.0, 4.0)


def driven(system, *, command, yaw=0.0, until_s=0.251, seed=0):
    builder = DiagramBuilder()
    builder.AddSystem(system)
    inputs = {"command": command, "state": [0.0, 0.0, yaw, 0.0, 0.0, 0.0]}
    for name, values in inputs.items():
        if system.HasInputPort(name):
            source = builder.AddSystem(ConstantVectorSource(values))
            builder.Connect(source.get_output_port(), system.GetInputPort(name))
    simulator = Simulator(builder.Build())
    context = system.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    if isinstance(system, SlippingWheels):
        context.get_mutable_abstract_parameter(system.seed_parameter).set_value(seed)
    simulator.AdvanceTo(until_s)
    name = "obeyed" if isinstance(system, SlippingWheels) else "reached"
    return system.GetOutputPort(name).Eval(context)


def motors(**settings):
    settings = Timeline.constant(ActuatorSettings(**settings))
    return LimitedForce(settings, mass_kg=100.0, bounds=BOUNDS, offset_s=0.0)


def test_a_payload_as_heavy_as_the_robot_halves_both_accelerations():
    # Eleven steps from 0 to 0.25 s: 0.275 s at 1 m/s^2 and 2 rad/s^2.
    v, w, _ = driven(motors(payload_kg=100.0), command=[1.0, 2.0, 0.0])
    assert (v, w) == pytest.approx((0.275, 0.55))


def test_a_given_force_replaces_the_drives_limit():
    v, _, _ = driven(motors(force_n=50.0), command=[1.0, 0.0, 0.0])
    assert v == pytest.approx(0.275 * 0.5)


@pytest.mark.parametrize(("yaw", "sign"), [(0.0, -1.0), (math.pi, 1.0), (0.5 * math.pi, 0.0)])
def test_a_slope_pulls_downhill(yaw, sign):
    v, _, _ = driven(motors(slope_rad=0.1), command=[1.0, 0.0, 0.0], yaw=yaw)
    gained = 2.0 + sign * GRAVITY_MPS2 * math.sin(0.1)
    assert v == pytest.approx(0.275 * gained)


def test_on_a_slope_too_steep_it_rolls_back():
    v, _, _ = driven(motors(slope_rad=0.4), command=[1.0, 0.0, 0.0])
    assert v == pytest.approx(0.275 * (2.0 - GRAVITY_MPS2 * math.sin(0.4)))
    assert v < 0.0


def test_what_it_reaches_it_keeps():
    reached = driven(motors(payload_kg=50.0, slope_rad=0.05), command=[0.4, -0.3, 0.0], until_s=3.0)
    np.testing.assert_allclose(reached, [0.4, -0.3, 0.0])


def test_slip_takes_its_share_of_the_speed_and_its_noise_follows_the_seed():
    steady = SlippingWheels(Timeline.constant(ActuatorSettings(slip=0.25)))
    np.testing.assert_allclose(driven(steady, command=[0.4, 0.2, 0.0]), [0.3, 0.15, 0.0])
    noisy = [
        driven(
            SlippingWheels(Timeline.constant(ActuatorSettings(slip=0.25, slip_std=0.1))),
            command=[0.4, 0.2, 0.0],
            seed=seed,
        )
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(noisy[0], noisy[1])
    assert not np.allclose(noisy[0], noisy[2])
