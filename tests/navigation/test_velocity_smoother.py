"""The velocity smoother's ramps by hand-computed numbers; frequency 20 Hz unless it is said."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from drake_navbench.navigation.velocity_smoother import (
    SmootherState,
    VelocitySmoother,
    VelocitySmootherParameters,
)

REST = np.zeros(3)


def ramp(command, count, *, state=None, measured=REST, age=0.0, **parameters):
    """Returns the outputs [v, w] of `count` steps towards a command [v, w]; vy stays 0."""
    smoother = VelocitySmoother(VelocitySmootherParameters(**parameters))
    state = state or SmootherState()
    outputs = []
    for _ in range(count):
        state, output = smoother.step(
            state, np.array([*command, 0.0]), measured=measured, command_age_s=age
        )
        assert output is None or output[2] == 0.0
        outputs.append(None if output is None else output[:2])
    return outputs


def test_from_rest_both_axes_speed_up_by_their_own_limits():
    outputs = ramp([0.5, 1.0], 8)
    # 2.5 m/s^2 / 20 Hz = 0.125 m/s and 3.2 rad/s^2 / 20 Hz = 0.16 rad/s a step.
    v = [0.125, 0.25, 0.375, 0.5, 0.5, 0.5, 0.5, 0.5]
    w = [0.16, 0.32, 0.48, 0.64, 0.80, 0.96, 1.0, 1.0]
    np.testing.assert_allclose(outputs, np.column_stack([v, w]))


def test_braking_uses_the_deceleration_limit():
    moving = SmootherState((0.5, 0.0, 0.0))
    outputs = ramp([0.2, 0.0], 3, state=moving, max_decel=(-2.0, 0.0, -3.2))
    np.testing.assert_allclose(np.array(outputs)[:, 0], [0.4, 0.3, 0.2])


def test_a_reversal_brakes_until_it_is_past_zero_within_one_step():
    moving = SmootherState((0.15, 0.0, 0.0))
    outputs = ramp([-0.5, 0.0], 4, state=moving, max_decel=(-2.0, 0.0, -3.2))
    # Two steps of -0.1 brake through zero; from -0.05 on it speeds up by 0.125 a step.
    np.testing.assert_allclose(np.array(outputs)[:, 0], [0.05, -0.05, -0.175, -0.3])


def test_commands_are_cut_to_the_velocity_limits():
    outputs = ramp([2.0, -9.0], 40)
    np.testing.assert_allclose(outputs[-1], [0.5, -2.5])


def test_scaled_velocities_keep_the_direction_of_the_change():
    # v would need 0.5 and may change by 0.125: a quarter. w would need 0.2, well within 0.16 * ...
    (output,) = ramp([0.5, 0.2], 1, scale_velocities=True)
    np.testing.assert_allclose(output, [0.125, 0.05])


def test_scaled_velocities_take_the_ratio_farthest_from_one():
    # v: 0.125 / 0.25 = 0.5; w: 0.16 / 1.6 = 0.1.
    (output,) = ramp([0.25, 1.6], 1, scale_velocities=True)
    np.testing.assert_allclose(output, [0.025, 0.16])


def test_the_deadband_does_not_hold_the_ramp_back():
    outputs = ramp([0.5, 0.0], 3, deadband_velocity=(0.2, 0.0, 0.0))
    np.testing.assert_allclose(np.array(outputs)[:, 0], [0.0, 0.25, 0.375])


def test_closed_loop_starts_each_step_from_the_odometry():
    outputs = ramp([0.5, 0.0], 2, feedback="CLOSED_LOOP", measured=np.array([0.1, 0.0, 0.0]))
    np.testing.assert_allclose(np.array(outputs)[:, 0], [0.225, 0.225])


def test_a_command_that_is_too_old_ramps_down_and_then_nothing_is_sent():
    moving = SmootherState((0.2, 0.0, 0.0))
    outputs = ramp([0.5, 0.0], 4, state=moving, age=1.1)
    np.testing.assert_allclose([output[0] for output in outputs[:2]], [0.075, 0.0])
    assert outputs[2:] == [None, None]


def test_a_command_exactly_as_old_as_the_timeout_is_still_good():
    (output,) = ramp([0.5, 0.0], 1, age=1.0)
    assert output[0] == pytest.approx(0.125)


def test_the_third_axis_has_the_limits_that_nav2_gives_second():
    limits = {"max_velocity": (0.5, 0.3, 2.5), "max_accel": (2.5, 1.0, 3.2)}
    smoother = VelocitySmoother(VelocitySmootherParameters(**limits))
    state, outputs = SmootherState(), []
    for _ in range(8):
        state, output = smoother.step(state, np.array([0.0, 0.0, 1.0]), measured=REST)
        outputs.append(output)
    # 1 m/s^2 / 20 Hz = 0.05 m/s a step, up to 0.3 m/s.
    sideways = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.3, 0.3]
    np.testing.assert_allclose(outputs, [[0.0, 0.0, vy] for vy in sideways], atol=1e-15)


SPEEDS = st.floats(-0.5, 0.5)


@given(v=SPEEDS, w=SPEEDS, last_v=SPEEDS, last_w=SPEEDS, scale=st.booleans())
def test_a_mirrored_command_gives_the_mirrored_output(v, w, last_v, last_w, scale):
    here = ramp([v, w], 1, state=SmootherState((last_v, last_w, 0.0)), scale_velocities=scale)[0]
    there = ramp([v, -w], 1, state=SmootherState((last_v, -last_w, 0.0)), scale_velocities=scale)[0]
    np.testing.assert_allclose(there, here * [1.0, -1.0], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_velocity", (-0.6, 0.0, 1.0)),
        ("min_velocity", (0.6, 0.0, -1.0)),
        ("max_accel", (-2.5, 0.0, 3.2)),
        ("max_decel", (2.5, 0.0, -3.2)),
        ("max_velocity", (0.5, 2.0)),
        ("feedback", "HALF_OPEN"),
    ],
)
def test_parameters_that_make_no_sense_are_refused_by_name(name, value):
    with pytest.raises(ValidationError, match=name):
        VelocitySmootherParameters(**{name: value})


@pytest.mark.parametrize(
    ("frequency_hz", "period_s"), [(20.0, 0.05), (30.0, 0.033), (60.0, 0.016), (700.0, 0.001)]
)
def test_the_timer_counts_whole_milliseconds(frequency_hz, period_s):
    assert VelocitySmootherParameters(smoothing_frequency=frequency_hz).period_s == period_s
