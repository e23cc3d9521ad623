"""Odometry drifts against the world, and fixes tell where it lies in the map."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.timeline import Timeline, timeline
from drake_navbench.kernels.poses import compose, drifted_frame
from drake_navbench.trial.systems.scripted_localization import ScriptedLocalization

POSES = st.tuples(*[st.floats(-20.0, 20.0)] * 2, st.floats(-7.0, 7.0))


def drive(settings, *, until_s=10.01, speed=1.0, yaw_rate=0.0, seed=0, at_s=(), gains=None):
    """Returns the ports' values at the end, or at several times, of a drive from the origin.

    gains: of the wheels, which are 0.5 m apart; None: nothing is connected, as where none slips.
    """
    settings = settings if isinstance(settings, Timeline) else Timeline.constant(settings)
    builder = DiagramBuilder()
    twist = [speed, yaw_rate, 0.0]
    ends = np.array([[0.0, 0.0, 0.0, *twist], [speed * 100.0, 0.0, yaw_rate * 100.0, *twist]]).T
    ride = PiecewisePolynomial.FirstOrderHold([0.0, 100.0], ends)
    truth = builder.AddSystem(TrajectorySource(ride))
    noise = builder.AddSystem(ConstantVectorSource(np.zeros(6)))
    system = builder.AddSystem(ScriptedLocalization(settings, offset_s=0.0, wheel_separation_m=0.5))
    builder.Connect(truth.get_output_port(), system.GetInputPort("state"))
    builder.Connect(noise.get_output_port(), system.GetInputPort("noise"))
    if gains is not None:
        wheels = builder.AddSystem(ConstantVectorSource(np.array(gains)))
        builder.Connect(wheels.get_output_port(), system.GetInputPort("wheel_gains"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = system.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    system.set_start(context, np.zeros(3), seed)
    simulator.Initialize()
    names = ("odometry", "estimate", "map_from_odometry")
    seen = []
    for time_s in at_s or (until_s,):
        simulator.AdvanceTo(time_s)
        told = {name: system.GetOutputPort(name).Eval(context) for name in names}
        seen.append(
            told
            | {
                "truth": truth.get_output_port().Eval(
                    truth.GetMyContextFromRoot(simulator.get_context())
                )
            }
        )
    return seen if at_s else seen[0]


def test_without_errors_every_frame_is_the_worlds():
    told = drive(LocalizationSettings(fix_period_s=0.5), yaw_rate=0.1)
    np.testing.assert_allclose(told["odometry"], told["truth"], atol=1e-12)
    np.testing.assert_allclose(told["estimate"], told["truth"], atol=1e-12)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_drift_is_that_share_of_the_way(seed):
    # 10 m at 0.02 m/m: 0.2 m off, whichever way.
    told = drive(LocalizationSettings(drift=0.02), seed=seed)
    error = told["odometry"] - told["truth"]
    assert math.hypot(*error[:2]) == pytest.approx(0.2, rel=1e-6)
    np.testing.assert_allclose(told["estimate"], told["odometry"])


def test_the_heading_drifts_with_every_radian_turned():
    told = drive(LocalizationSettings(yaw_drift=0.1), speed=0.0, yaw_rate=-0.5)
    assert abs(told["odometry"][2] - told["truth"][2]) == pytest.approx(0.5, rel=1e-6)


def test_a_bias_to_the_left_stays_to_the_left():
    settings = LocalizationSettings(y_bias_m=0.1, fix_period_s=0.05)
    told = drive(settings, yaw_rate=0.1, until_s=5.0)
    yaw = told["truth"][2]
    left = told["truth"][:2] + 0.1 * np.array([-math.sin(yaw), math.cos(yaw)])
    np.testing.assert_allclose(told["estimate"][:2], left, atol=1e-3)


def test_a_jump_happens_at_its_time_and_stays():
    settings = LocalizationSettings(jump_m=0.3, jump_time_s=2.0)
    before, after, later = drive(settings, at_s=(1.99, 2.01, 8.0))
    np.testing.assert_allclose(before["estimate"], before["truth"])
    for told in (after, later):
        error = told["estimate"] - told["truth"]
        assert math.hypot(*error[:2]) == pytest.approx(0.3)
        np.testing.assert_allclose(told["odometry"], told["truth"])


def test_a_fix_undoes_the_drift_until_its_instant_and_takes_effect_after_its_lag():
    # The fix of 4 s takes effect at 4.5 s; by then another 0.5 m have been driven at 0.1 m/m.
    settings = LocalizationSettings(drift=0.1, fix_period_s=4.0, fix_lag_s=0.5)
    before, after = drive(settings, at_s=(4.49, 4.51))
    off = [math.hypot(*(told["estimate"] - told["truth"])[:2]) for told in (before, after)]
    assert off[0] == pytest.approx(0.449, abs=0.006)
    assert off[1] == pytest.approx(0.051, abs=0.006)


def test_a_fault_lasts_for_its_time():
    usual = LocalizationSettings()
    off = timeline(usual, [(2.0, 4.0, lambda _: LocalizationSettings(x_bias_m=0.5))])
    errors = [
        (told["estimate"] - told["truth"])[0] for told in drive(off, at_s=(1.9, 2.1, 3.9, 4.1))
    ]
    np.testing.assert_allclose(errors, [0.0, 0.5, 0.5, 0.0], atol=1e-9)


@pytest.mark.parametrize("gains", [None, (1.0, 1.0)])
def test_wheels_that_do_not_slip_tell_the_true_motion(gains):
    """Where nothing can slip, a trial connects no gains."""
    told = drive(LocalizationSettings(wheel_odometry=True), yaw_rate=0.1, gains=gains)
    for name in ("odometry", "estimate"):
        np.testing.assert_allclose(told[name], told["truth"], atol=1e-12)


def test_an_odometry_by_wheels_that_do_not_slip_drifts_as_any_other():
    settings = LocalizationSettings(wheel_odometry=True, drift=0.02)
    told = drive(settings)
    assert math.hypot(*(told["odometry"] - told["truth"])[:2]) == pytest.approx(0.2, rel=1e-6)
    np.testing.assert_array_equal(told["odometry"], drive(settings, gains=(1.0, 1.0))["odometry"])


def test_wheels_that_slip_tell_more_way_and_speed_than_there_is():
    # By the last step, at 10 s, 9 m at gains of 0.9: wheels that turn 10 m, at 1 m/s; then 9 mm.
    told = drive(LocalizationSettings(wheel_odometry=True), speed=0.9, gains=(0.9, 0.9))
    assert told["odometry"] == pytest.approx([10.009, 0.0, 0.0, 1.0, 0.0, 0.0])


def test_the_seed_alone_draws_the_directions():
    settings = LocalizationSettings(drift=0.02, jump_m=0.1, fix_period_s=1.0, fix_xy_std_m=0.1)
    first, again, other = (drive(settings, seed=seed)["estimate"] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.allclose(first, other)


@given(POSES, POSES, POSES)
def test_a_drifted_frame_shifts_the_pose_by_the_error(frame, pose, error):
    frame, pose, error = map(np.array, (frame, pose, error))
    moved = drifted_frame(frame, pose, *error)
    np.testing.assert_allclose(
        compose(moved, pose), compose(compose(frame, pose), error), atol=1e-9
    )
