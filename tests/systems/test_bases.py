"""The ideal bases move as their equations say, by hand-computed numbers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scenes import WHEELCHAIR

from drake_navbench.inputs.drive import AckermannDrive, DifferentialDrive, OmnidirectionalDrive
from drake_navbench.trial.systems.ackermann_base import AckermannBase
from drake_navbench.trial.systems.omnidirectional_base import OmnidirectionalBase
from drake_navbench.trial.systems.wheelchair import Wheelchair

OMNI = OmnidirectionalDrive(
    type="omnidirectional",
    max_linear_acceleration_mps2=None,
    max_lateral_acceleration_mps2=None,
    max_angular_acceleration_radps2=None,
)
CAR = AckermannDrive(
    type="ackermann",
    wheelbase_m=0.5,
    min_turning_radius_m=0.8,
    max_steering_rate_radps=None,
    max_linear_acceleration_mps2=None,
)
FREE = DifferentialDrive(max_linear_acceleration_mps2=None, max_angular_acceleration_radps2=None)
BASES = {
    OmnidirectionalDrive: OmnidirectionalBase,
    AckermannDrive: AckermannBase,
    DifferentialDrive: Wheelchair,
}


class Rig:
    """A base at rest at a pose under a constant command [v, w, vy]."""

    def __init__(self, drive, command, *, pose=(0.0, 0.0, 0.0)):
        builder = DiagramBuilder()
        scene_graph = builder.AddSystem(SceneGraph())
        self.base = BASES[type(drive)](drive, scene_graph, footprint=WHEELCHAIR)
        builder.AddSystem(self.base)
        source = builder.AddSystem(ConstantVectorSource(command))
        builder.Connect(source.get_output_port(), self.base.get_command_input_port())
        builder.Connect(
            self.base.get_geometry_pose_output_port(),
            scene_graph.get_source_pose_port(self.base.source_id),
        )
        self.simulator = Simulator(builder.Build())
        config = SimulatorConfig(
            integration_scheme="runge_kutta3", max_step_size=0.005, use_error_control=False
        )
        ApplySimulatorConfig(config, self.simulator)
        self.context = self.base.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.base.set_pose(self.context, np.array(pose))

    def at(self, time_s):
        """Returns the state [x, y, yaw, v, w, vy] at a time."""
        self.simulator.AdvanceTo(time_s)
        return self.base.get_state_output_port().Eval(self.context)

    def set_state(self, state):
        self.base.set_state(self.context, np.array(state))


def with_limits(drive, **limits):
    return drive.model_copy(update=limits)


def test_without_acceleration_limits_the_velocity_is_a_first_order_response():
    *_, v, w, _ = Rig(FREE, [0.4, 0.2, 0.0]).at(0.1)
    # One time constant: 1 - 1/e of the command.
    assert v == pytest.approx(0.4 * (1.0 - np.exp(-1.0)), rel=1e-5)
    assert w == pytest.approx(0.2 * (1.0 - np.exp(-1.0)), rel=1e-5)


def test_the_distance_lags_by_the_time_constant_once_at_speed():
    x, y, yaw, *_ = Rig(FREE, [0.4, 0.0, 0.0]).at(2.0)
    # v T - v tau (1 - exp(-T / tau))
    assert x == pytest.approx(0.4 * 2.0 - 0.4 * 0.1, abs=1e-6)
    assert (y, yaw) == (0.0, 0.0)


def test_the_acceleration_limit_makes_a_ramp():
    *_, v, _, _ = Rig(with_limits(FREE, max_linear_acceleration_mps2=0.5), [0.5, 0.0, 0.0]).at(0.5)
    assert v == pytest.approx(0.25, abs=1e-3)


def test_commands_beyond_the_limits_are_saturated():
    *_, v, w, _ = Rig(DifferentialDrive(), [9.0, -9.0, 0.0]).at(3.0)
    assert (v, w) == pytest.approx((0.5, -2.0), abs=1e-6)


def test_at_constant_speed_and_turn_rate_the_path_is_a_circle():
    quick = with_limits(FREE, response_time_constant_s=0.01)
    x, y, *_ = Rig(quick, [0.5, 0.5, 0.0]).at(2.0 * np.pi / 0.5)
    # Radius 1 m: after one turn it is back, less the start-up lag of half a centimetre.
    assert np.hypot(x, y) < 0.01


def test_a_mirrored_command_gives_the_mirrored_path():
    left, right = (Rig(DifferentialDrive(), [0.5, w, 0.0]).at(3.0) for w in (0.3, -0.3))
    np.testing.assert_allclose(right, left * [1, -1, -1, 1, -1, 1], atol=1e-12)


def test_the_footprint_stands_where_the_state_says():
    rig = Rig(DifferentialDrive(), [0.0, 0.0, 0.0], pose=(1.0, 2.0, 0.5 * np.pi))
    poses = rig.base.get_geometry_pose_output_port().Eval(rig.context)
    front = poses.value(rig.base.frame_id) @ np.array([0.85, 0.3, 0.0])
    # Facing along y: ahead is up, left is to smaller x.
    np.testing.assert_allclose(front, [1.0 - 0.3, 2.0 + 0.85, 0.0], atol=1e-12)


@pytest.mark.parametrize("drive", [OMNI, CAR, DifferentialDrive()])
def test_the_state_does_not_jump_with_the_command(drive):
    base = BASES[type(drive)](drive, SceneGraph(), footprint=WHEELCHAIR)
    assert not base.HasDirectFeedthrough(base.get_state_output_port().get_index())


def test_an_omnidirectional_base_goes_straight_to_the_left_without_turning():
    x, y, yaw, v, w, vy = Rig(OMNI, [0.0, 0.0, 0.4]).at(2.0)
    # vy T - vy tau, once at speed
    assert y == pytest.approx(0.4 * 2.0 - 0.4 * 0.1, abs=1e-6)
    assert (x, yaw, v, w) == (0.0, 0.0, 0.0, 0.0)
    assert vy == pytest.approx(0.4, abs=1e-6)


def test_an_omnidirectional_base_goes_diagonally_along_the_direction_of_its_velocity():
    pose = [1.0, 2.0, 0.5 * np.pi]
    x, y, yaw, *_ = Rig(OMNI, [0.3, 0.0, 0.3], pose=pose).at(2.0)
    # Facing north, left is west: as far to the north as to the west.
    assert (x - 1.0, y - 2.0) == pytest.approx((-0.3 * 1.9, 0.3 * 1.9), abs=1e-6)
    assert yaw == 0.5 * np.pi


def test_an_omnidirectional_base_circles_sideways():
    # The point that rests lies -vy / w = 0.4 m ahead.
    rig = Rig(OMNI, [0.0, 1.0, -0.4])
    rig.set_state([0.0, 0.0, 0.0, 0.0, 1.0, -0.4])
    for time_s in (1.0, 2.0, 5.0):
        x, y, *_ = rig.at(time_s)
        assert np.hypot(x - 0.4, y) == pytest.approx(0.4, abs=1e-6)


def test_each_axis_of_an_omnidirectional_base_has_its_own_limits():
    limited = with_limits(OMNI, max_lateral_velocity_mps=0.2, max_lateral_acceleration_mps2=0.5)
    rig = Rig(limited, [0.4, 0.0, 1.0])
    # 0.5 m/s^2 for 0.2 s; the forward axis has no limit on its acceleration.
    *_, v, _, vy = rig.at(0.2)
    assert vy == pytest.approx(0.1, abs=2e-3)
    assert v == pytest.approx(0.4 * (1.0 - np.exp(-2.0)), abs=1e-5)
    assert rig.at(3.0)[5] == pytest.approx(0.2, abs=1e-6)


def test_a_wheelchair_cannot_be_moved_sideways():
    np.testing.assert_array_equal(Rig(DifferentialDrive(), [0.0, 0.0, 0.5]).at(1.0), np.zeros(6))


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.25), (0.5, -0.4), (-0.3, 0.2)])
def test_a_car_drives_a_circle_of_the_commanded_radius(v, w):
    rig = Rig(CAR, [v, w, 0.0])
    rig.set_state([0.0, 0.0, 0.0, v, w, 0.0])
    radius = v / w
    for time_s in (1.0, 3.0, 7.0):
        x, y, yaw, _, rate, _ = rig.at(time_s)
        assert np.hypot(x, y - radius) == pytest.approx(abs(radius), abs=1e-5)
        assert yaw == pytest.approx(w * time_s, abs=1e-5)
        assert rate == pytest.approx(w, abs=1e-6)


def test_a_car_turns_about_a_point_on_its_rear_axle():
    """0.48 m/s and 0.4 rad/s: 1.2 m beside the axle, which lies 0.5 m behind the origin.

    So the origin, 1.3 m from that point, drives 0.5 m * 0.4 rad/s to the left.
    """
    rig = Rig(with_limits(CAR, rear_axle_x_m=-0.5), [0.48, 0.4, 0.0])
    rig.set_state([0.0, 0.0, 0.0, 0.48, 0.4, 0.2])
    for time_s in (0.0, 1.0, 7.0):
        x, y, yaw, v, w, vy = rig.at(time_s)
        assert np.hypot(x + 0.5, y - 1.2) == pytest.approx(1.3, abs=1e-5)
        assert (v, w, vy) == pytest.approx((0.48, 0.4, 0.2), abs=1e-6)
        assert yaw == pytest.approx(0.4 * time_s, abs=1e-5)


def test_a_car_turns_no_tighter_than_at_full_lock():
    rig = Rig(CAR, [0.4, 2.0, 0.0])
    *_, w, _ = rig.at(3.0)
    assert w == pytest.approx(0.4 / 0.8, abs=1e-6)


def test_the_steering_takes_the_time_that_its_rate_allows():
    slow = with_limits(CAR, max_steering_rate_radps=0.5)
    rig = Rig(slow, [0.4, 0.5, 0.0])
    rig.set_state([0.0, 0.0, 0.0, 0.4, 0.0, 0.0])
    # Full lock is atan(0.5 / 0.8) = 0.559 rad; after 0.6 s at 0.5 rad/s 0.3 rad of it is there.
    *_, w, _ = rig.at(0.6)
    assert w == pytest.approx(0.4 * np.tan(0.3) / 0.5, rel=1e-3)


def test_a_car_told_to_turn_in_place_stands_still():
    np.testing.assert_array_equal(Rig(CAR, [0.0, 1.0, 0.0]).at(2.0), np.zeros(6))


def test_a_car_keeps_its_curvature_while_its_speed_lags():
    slow = with_limits(CAR, max_linear_acceleration_mps2=0.1)
    rig = Rig(slow, [0.5, 0.25, 0.0])
    for time_s in (1.5, 2.0, 3.0):
        *_, v, w, _ = rig.at(time_s)
        assert v < 0.31
        # The wheels have long turned; w / v is the commanded 0.5 1/m.
        assert w / v == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("drive", [OMNI, CAR, DifferentialDrive()])
def test_a_state_that_was_set_is_the_state(drive):
    vy = 0.2 if drive is OMNI else 0.0
    state = [1.0, -2.0, 0.7, 0.3, -0.1, vy]
    rig = Rig(drive, [0.0, 0.0, 0.0])
    rig.set_state(state)
    np.testing.assert_allclose(rig.at(0.0), state, atol=1e-12)


SPEEDS, RATES = st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)


@settings(max_examples=25, deadline=None)
@given(
    v=SPEEDS, w=RATES, vy=SPEEDS, kind=st.sampled_from(["omni", "car", "long car", "wheelchair"])
)
def test_no_motion_exceeds_the_bounds_by_which_contact_is_ruled_out(v, w, vy, kind):
    drive = {
        "omni": OmnidirectionalDrive(type="omnidirectional"),
        "car": AckermannDrive(type="ackermann", wheelbase_m=0.5, min_turning_radius_m=0.8),
        "long car": CAR.model_copy(
            update={
                "rear_axle_x_m": -0.6,
                "max_steering_rate_radps": 1.0,
                "max_linear_acceleration_mps2": 2.5,
            }
        ),
        "wheelchair": DifferentialDrive(),
    }[kind]
    bounds, step_s = drive.bounds, 0.02
    rig = Rig(drive, [v, w, vy])
    before_speed = before_rate = 0.0
    for k in range(1, 31):
        *_, forward, rate, sideways = rig.at(k * step_s)
        speed = np.hypot(forward, sideways)
        assert speed <= bounds.speed_mps + 1e-9
        assert abs(rate) <= bounds.yaw_rate_radps + 1e-9
        assert abs(speed - before_speed) <= bounds.acceleration_mps2 * step_s + 1e-9
        assert abs(rate - before_rate) <= bounds.yaw_acceleration_radps2 * step_s + 1e-9
        before_speed, before_rate = speed, rate
