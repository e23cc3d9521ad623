"""What moves is seen where it is, at every instant, in a real Diagram."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.moving_obstacles import (
    MovingBox,
    MovingCylinder,
    MovingObstacles,
    TimedPose,
)
from drake_navbench.inputs.people import People, Person, WalkingPeople
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.world import Cylinder, World
from drake_navbench.trial.systems.clearance import Clearance
from drake_navbench.trial.systems.depth_sensors import DepthSensors
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.moving_world import MovingWorld
from drake_navbench.trial.systems.ports import NOTHING

# From x = 6 m towards the robot at 0.5 m/s, from 1 s on.
COMES = MovingCylinder(
    type="cylinder",
    radius_m=0.5,
    waypoints=[
        TimedPose(time_s=1.0, position=(6.0, 0.0)),
        TimedPose(time_s=9.0, position=(2.0, 0.0)),
    ],
)
TURNS = MovingBox(
    type="box",
    size_m=(2.0, 1.0),
    waypoints=[
        TimedPose(time_s=0.0, position=(0.0, 4.0)),
        TimedPose(time_s=4.0, position=(0.0, 4.0), yaw_rad=np.pi / 2),
    ],
)
PILLAR = Cylinder(type="cylinder", centre=(-3.0, 0.0), radius_m=0.5)
ROBOT = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


@pytest.fixture
def simulation():
    world = World((PILLAR,), moving=MovingObstacles((COMES, TURNS)))
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    moving = builder.AddNamedSystem(
        "moving_world", MovingWorld(world, scene_graph, footprint=ROBOT, scan_height_m=0.2)
    )
    builder.Connect(
        moving.get_geometry_pose_output_port(), scene_graph.get_source_pose_port(moving.source_id)
    )
    state = builder.AddSystem(ConstantVectorSource(np.zeros(6)))
    lidar = builder.AddNamedSystem(
        "lidar", Lidar(Timeline.constant(LidarSettings(beam_count=4)), world)
    )
    clearance = builder.AddNamedSystem(
        "clearance", Clearance(world, footprint=ROBOT, period_s=0.05, offset_s=0.0)
    )
    for system in (lidar, clearance):
        builder.Connect(state.get_output_port(), system.GetInputPort("state"))
        builder.Connect(moving.GetOutputPort("outlines"), system.GetInputPort("moving"))
    builder.ExportInput(clearance.GetInputPort("costmap"), "costmap")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    diagram.GetInputPort("costmap").FixValue(
        simulator.get_mutable_context(), AbstractValue.Make(NOTHING)
    )
    simulator.Initialize()
    return diagram, simulator, scene_graph


def evaluated(simulation, system, port, time_s):
    diagram, simulator, _ = simulation
    simulator.AdvanceTo(time_s)
    simulator.AdvancePendingEvents()
    owner = diagram.GetSubsystemByName(system)
    context = owner.GetMyContextFromRoot(simulator.get_context())
    return owner.GetOutputPort(port).Eval(context)


def test_bodies_are_on_their_ways(simulation):
    poses = evaluated(simulation, "moving_world", "poses", 5.0)
    np.testing.assert_allclose(poses, [4.0, 0.0, 0.0, 0.0, 4.0, np.pi / 2], atol=1e-12)


def test_the_lidar_sees_them_where_they_are_beside_what_stands(simulation):
    # Ahead the cylinder's near side at x(t) - 0.5; behind the pillar; to the left the box.
    behind, _, ahead, left = evaluated(simulation, "lidar", "scan", 3.0).ranges_m
    assert ahead == pytest.approx(5.0 - 0.5, abs=1e-6)
    assert behind == pytest.approx(2.5, abs=1e-6)
    assert left == pytest.approx(_near_side(3.0), abs=1e-6)
    _, _, ahead, left = evaluated(simulation, "lidar", "scan", 7.0).ranges_m
    assert ahead == pytest.approx(3.0 - 0.5, abs=1e-6)
    # Turned by a right angle it reaches 1 m towards the robot.
    assert left == pytest.approx(3.0, abs=1e-6)


def _near_side(time_s):
    """Where the ray along y meets the box, whose long side has turned: half its width / cos."""
    yaw = np.pi / 2 * time_s / 4.0
    return 4.0 - min(0.5 / np.cos(yaw), 1.0 / np.sin(yaw))


def test_the_clearance_is_to_the_nearest_of_what_stands_and_what_moves(simulation):
    # The pillar is 2 m away, the cylinder at 3 s still 4 m; at 9 s it is 1 m away.
    assert evaluated(simulation, "clearance", "distances", 3.0)[0] == pytest.approx(2.0)
    assert evaluated(simulation, "clearance", "distances", 9.0)[0] == pytest.approx(1.0)


def test_depth_sensors_are_told_their_heights(simulation):
    solids = evaluated(simulation, "moving_world", "solids", 5.0)
    assert solids.starts.tolist() == [0, 4]
    np.testing.assert_allclose(solids.heights, [1.0])
    np.testing.assert_allclose(solids.circles, [[4.0, 0.0, 0.5]])
    sensors = DepthSensors(
        {"camera": DepthSensorSettings(sees_floor=False, column_count=97)}, World((PILLAR,))
    )
    context = sensors.CreateDefaultContext()
    sensors.GetInputPort("state").FixValue(context, np.zeros(6))
    sensors.GetInputPort("moving").FixValue(context, AbstractValue.Make(solids))
    looked = Simulator(sensors, context)
    looked.Initialize()
    looked.AdvancePendingEvents()
    points = sensors.GetOutputPort("clouds").Eval(looked.get_context())["camera"].points
    # The near side of the cylinder, as high as it is at most.
    assert points[:, 0].min() == pytest.approx(3.5, abs=1e-3)
    assert points[:, 2].max() <= 1.0


def test_scene_graph_has_them_where_they_are(simulation):
    query = evaluated(simulation, "moving_world", "geometry_pose", 5.0)
    _, simulator, scene_graph = simulation
    placed = scene_graph.get_query_output_port().Eval(
        scene_graph.GetMyContextFromRoot(simulator.get_context())
    )
    inspector = placed.inspector()
    where = [placed.GetPoseInWorld(f).translation()[0] for f in query.ids()]
    assert sorted(where) == pytest.approx([0.0, 4.0])
    assert inspector.num_geometries() == 2


def test_the_lidar_looks_over_what_is_lower_than_its_plane_and_the_clearance_does_not():
    low = COMES.model_copy(update={"height_m": 0.15})
    low_box = TURNS.model_copy(update={"height_m": 0.15})
    world = World((), moving=MovingObstacles((low, TURNS, low_box)))
    moving = MovingWorld(world, SceneGraph(), footprint=ROBOT, scan_height_m=0.2)
    context = moving.CreateDefaultContext()
    edges, circles = moving.GetOutputPort("scanned").Eval(context)
    assert (edges.shape, circles.shape) == ((4, 4), (0, 3))
    edges, circles = moving.GetOutputPort("outlines").Eval(context)
    assert (edges.shape, circles.shape) == ((8, 4), (1, 3))


def test_in_a_default_context_people_stand_where_the_file_has_them():
    everybody = WalkingPeople(People(persons=[Person(start=(2.0, 1.0), goals=[(5.0, 1.0)])]))
    world = World((), people=everybody)
    moving = MovingWorld(world, SceneGraph(), footprint=ROBOT, scan_height_m=0.2)
    (person,) = moving.people_at(moving.CreateDefaultContext())
    assert person[:2].tolist() == [2.0, 1.0]
