"""The base follows its commands as a first-order response within its limits."""

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from scenes import WHEELCHAIR

from drake_navbench.inputs.drive import DifferentialDrive
from drake_navbench.trial.systems.wheelchair import Wheelchair


def drive(command, duration_s, *, settings=None, start=(0.0, 0.0, 0.0), step_s=0.005):
    """Returns the final state [x, y, yaw, v, w] after a constant command [v, w]."""
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    wheelchair = builder.AddSystem(
        Wheelchair(settings or DifferentialDrive(), scene_graph, footprint=WHEELCHAIR)
    )
    source = builder.AddSystem(ConstantVectorSource([*command, 0.0]))
    builder.Connect(source.get_output_port(), wheelchair.get_command_input_port())
    builder.Connect(
        wheelchair.get_geometry_pose_output_port(),
        scene_graph.get_source_pose_port(wheelchair.source_id),
    )
    simulator = Simulator(builder.Build())
    config = SimulatorConfig(
        integration_scheme="runge_kutta3", max_step_size=step_s, use_error_control=False
    )
    ApplySimulatorConfig(config, simulator)
    context = wheelchair.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    wheelchair.set_pose(context, np.array(start))
    simulator.AdvanceTo(duration_s)
    *state, vy = wheelchair.get_state_output_port().Eval(context)
    assert vy == 0.0
    return np.array(state)


FREE = DifferentialDrive(max_linear_acceleration_mps2=None, max_angular_acceleration_radps2=None)


def test_without_acceleration_limits_the_velocity_is_a_first_order_response():
    *_, v, w = drive([0.4, 0.2], 0.1, settings=FREE)
    # One time constant: 1 - 1/e of the command.
    assert v == pytest.approx(0.4 * (1.0 - np.exp(-1.0)), rel=1e-5)
    assert w == pytest.approx(0.2 * (1.0 - np.exp(-1.0)), rel=1e-5)


def test_the_distance_lags_by_the_time_constant_once_at_speed():
    x, y, yaw, *_ = drive([0.4, 0.0], 2.0, settings=FREE)
    # v T - v tau (1 - exp(-T / tau))
    assert x == pytest.approx(0.4 * 2.0 - 0.4 * 0.1, abs=1e-6)
    assert (y, yaw) == (0.0, 0.0)


def test_the_acceleration_limit_makes_a_ramp():
    slow = DifferentialDrive(max_linear_acceleration_mps2=0.5, response_time_constant_s=0.1)
    *_, v, _ = drive([0.5, 0.0], 0.5, settings=slow)
    assert v == pytest.approx(0.25, abs=1e-3)


def test_commands_beyond_the_limits_are_saturated():
    *_, v, w = drive([9.0, -9.0], 3.0)
    assert v == pytest.approx(0.5, abs=1e-6)
    assert w == pytest.approx(-2.0, abs=1e-6)


def test_at_constant_speed_and_turn_rate_the_path_is_a_circle():
    settings = FREE.model_copy(update={"response_time_constant_s": 0.01})
    x, y, *_ = drive([0.5, 0.5], 2.0 * np.pi / 0.5, settings=settings)
    # Radius 1 m: after one turn it is back, but for the start-up lag of half a centimetre.
    assert np.hypot(x, y) < 0.01


def test_a_mirrored_command_gives_the_mirrored_path():
    x, y, yaw, v, w = drive([0.5, 0.3], 3.0)
    mirrored = drive([0.5, -0.3], 3.0)
    np.testing.assert_allclose(mirrored, [x, -y, -yaw, v, -w], atol=1e-12)


def test_the_footprint_stands_where_the_state_says():
    scene_graph = SceneGraph()
    wheelchair = Wheelchair(DifferentialDrive(), scene_graph, footprint=WHEELCHAIR)
    context = wheelchair.CreateDefaultContext()
    wheelchair.set_pose(context, np.array([1.0, 2.0, 0.5 * np.pi]))
    poses = wheelchair.get_geometry_pose_output_port().Eval(context)
    front = poses.value(wheelchair.frame_id) @ np.array([0.85, 0.3, 0.0])
    # Facing along y: ahead is up, left is to smaller x.
    np.testing.assert_allclose(front, [1.0 - 0.3, 2.0 + 0.85, 0.0], atol=1e-12)


def test_the_state_does_not_jump_with_the_command():
    wheelchair = Wheelchair(DifferentialDrive(), SceneGraph(), footprint=WHEELCHAIR)
    assert not wheelchair.HasAnyDirectFeedthrough()
