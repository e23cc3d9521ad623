"""The sensors that send points see the world in three dimensions, each at its own pace."""

import numpy as np
import pytest
from pydantic import ValidationError
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.moving_obstacles import (
    MovingBox,
    MovingCylinder,
    MovingObstacles,
    TimedPose,
)
from drake_navbench.inputs.world import Box, World
from drake_navbench.trial.systems.depth_sensors import DepthSensors
from drake_navbench.trial.systems.moving_world import MovingWorld

WALL = World((Box(type="box", min=(3.0, -5.0), max=(3.2, 5.0), height_m=1.0),))
NARROW = {"column_count": 1, "row_count": 1, "vertical_fov_rad": 0.0}


def simulated(sensors, base_pose=(1.0, 0.0, 0.0), until_s=0.0, odometry=None):
    """Returns the clouds after a time."""
    system = DepthSensors({n: DepthSensorSettings(**s) for n, s in sensors.items()}, WALL)
    context = system.CreateDefaultContext()
    assert system.GetOutputPort("clouds").Eval(context) == {}
    system.GetInputPort("state").FixValue(context, [*base_pose, 0.0, 0.0, 0.0])
    if odometry is not None:
        system.GetInputPort("odometry").FixValue(context, [*odometry, 0.0, 0.0, 0.0])
    simulator = Simulator(system, context)
    simulator.Initialize()
    simulator.AdvanceTo(until_s)
    simulator.AdvancePendingEvents()
    return system.GetOutputPort("clouds").Eval(simulator.get_context())


def test_points_lie_on_the_wall_between_the_floor_and_its_top():
    cloud = simulated({"eye": {"height_m": 0.5}})["eye"]
    assert len(cloud.points)
    np.testing.assert_allclose(cloud.points[:, 0], 3.0)
    assert cloud.points[:, 2].min() >= 0.0
    assert cloud.points[:, 2].max() <= 1.0
    np.testing.assert_allclose(cloud.origin, [1.0, 0.0, 0.5])


def test_a_sensor_that_looks_down_meets_the_foot_of_the_wall():
    # 0.5 m up and 2 m away: the foot is atan(0.25) below.
    down = float(np.arctan(0.25)) - 1e-9
    eye = {"height_m": 0.5, "pitch_rad": down, "horizontal_fov_rad": 0.1} | NARROW
    cloud = simulated({"eye": {**eye, "column_count": 3}})["eye"]
    np.testing.assert_allclose(cloud.points[1], [3.0, 0.0, 0.0], atol=1e-6)


def test_a_sensor_that_looks_back_does_not_see_what_is_ahead():
    cloud = simulated({"eye": {"pose": (0.0, 0.0, np.pi)}})["eye"]
    assert cloud.points.shape == (0, 3)


def test_what_is_out_of_reach_is_not_sent():
    assert not len(simulated({"eye": {"range_max_m": 1.9}})["eye"].points)
    assert not len(simulated({"eye": {"range_min_m": 5.5}})["eye"].points)


def test_each_sensor_looks_at_its_own_pace():
    clouds = simulated({"fast": {"period_s": 0.1}, "slow": {"period_s": 0.4}}, until_s=0.35)
    assert clouds["fast"].time_s == pytest.approx(0.3)
    assert clouds["slow"].time_s == 0.0


def test_what_was_seen_lies_where_the_odometry_places_it():
    # The robot believes to stand at (0, 1) and to face +y: what is 2 m ahead is at y = 3.
    eye = {"height_m": 0.5} | NARROW | {"column_count": 3}
    seen = simulated({"eye": eye}, odometry=(0.0, 1.0, np.pi / 2.0))["eye"]
    np.testing.assert_allclose(seen.points[1], [3.0, 0.0, 0.5], atol=1e-12)
    placed = seen.placed_by_odometry()
    np.testing.assert_allclose(placed.points[1], [0.0, 3.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(placed.origin, [0.0, 1.0, 0.5], atol=1e-12)
    assert placed.yaw_rad == np.pi / 2.0
    assert placed.placed_by_odometry() is placed
    # The odometry's frame lies 10 m along x of the map's, turned by half a turn.
    in_map = seen.placed_by_odometry(np.array([10.0, 0.0, np.pi]))
    np.testing.assert_allclose(in_map.points[1], [10.0, -3.0, 0.5], atol=1e-12)


def test_rays_that_would_look_straight_down_are_refused():
    with pytest.raises(ValidationError, match=r"pitch_rad 1\.2 and vertical_fov_rad 1\.01"):
        DepthSensorSettings(pitch_rad=1.2)


def test_glass_is_not_seen():
    glass = World(tuple(o.model_copy(update={"material": "glass"}) for o in WALL.obstacles))
    system = DepthSensors({"eye": DepthSensorSettings()}, glass)
    solids = system.CreateDefaultContext().get_abstract_parameter(system.world_parameter)
    assert len(solids.get_value().segments) == 0


def way(*positions):
    """Returns a way with a second between its points."""
    return [TimedPose(time_s=float(n), position=position) for n, position in enumerate(positions)]


def test_what_moves_is_seen_up_to_its_height():
    box = MovingBox(
        type="box", size_m=(1.0, 4.0), height_m=0.4, waypoints=way((9.0, 0.0), (5.0, 0.0))
    )
    post = MovingCylinder(
        type="cylinder", radius_m=0.2, height_m=0.8, waypoints=way((3.0, 0.0), (2.0, 0.0))
    )
    world = World((), moving=MovingObstacles((box, post)))
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    moving = builder.AddSystem(
        MovingWorld(world, scene_graph, footprint=np.zeros((0, 2)), scan_height_m=0.2)
    )
    builder.Connect(
        moving.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(moving.source_id)
    )
    state = builder.AddSystem(ConstantVectorSource(np.zeros(6)))
    eye = DepthSensorSettings(height_m=0.5, range_max_m=20.0, period_s=1.0)
    sensors = builder.AddSystem(DepthSensors({"eye": eye}, world))
    builder.Connect(state.get_output_port(), sensors.GetInputPort("state"))
    builder.Connect(moving.GetOutputPort("solids"), sensors.GetInputPort("moving"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    simulator.AdvancePendingEvents()
    context = sensors.GetMyContextFromRoot(simulator.get_context())
    points = sensors.GetOutputPort("clouds").Eval(context)["eye"].points
    is_of_post = points[:, 0] < 3.0
    assert np.hypot(points[is_of_post, 0] - 2.0, points[is_of_post, 1]) == pytest.approx(0.2)
    assert 0.4 < points[is_of_post, 2].max() <= 0.8
    assert not is_of_post.all()
    assert points[~is_of_post, 0].min() == pytest.approx(4.5)
    assert points[~is_of_post, 2].max() <= 0.4
