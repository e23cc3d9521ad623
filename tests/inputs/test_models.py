"""The built-in robots: their files load, and the wheelchair's model agrees with its outline."""

import logging
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, Role, SceneGraph, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex, RevoluteJoint

from drake_navbench.inputs.robot import ROBOT_FILES, load_robot
from drake_navbench.kernels.footprint import footprint_radii

CASTER_ANGLES_RAD = np.linspace(-np.pi, np.pi, 25)


class WheelchairModel:
    """The parsed SDF file with base_link at the world's origin."""

    def __init__(self, path: Path) -> None:
        self.scene_graph = SceneGraph()
        self.plant = MultibodyPlant(0.0)
        self.plant.RegisterAsSourceForSceneGraph(self.scene_graph)
        (self.instance,) = Parser(self.plant).AddModels(str(path))
        self.plant.WeldFrames(self.plant.world_frame(), self.plant.GetFrameByName("base_link"))
        self.plant.Finalize()
        self.context = self.plant.CreateDefaultContext()

    def turn_casters(self, angle_rad: float) -> None:
        for side in ("left", "right"):
            joint = self.plant.GetJointByName(f"{side}_caster_swivel")
            joint.set_angle(self.context, angle_rad)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the corners of the box around all visuals, (3,) m each."""
        inspector = self.scene_graph.model_inspector()
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for geometry_id in inspector.GetAllGeometryIds(Role.kIllustration):
            body = self.plant.GetBodyFromFrameId(inspector.GetFrameId(geometry_id))
            pose = body.EvalPoseInWorld(self.context) @ inspector.GetPoseInFrame(geometry_id)
            reach = _half_extents(inspector.GetShape(geometry_id), pose)
            low = np.minimum(low, pose.translation() - reach)
            high = np.maximum(high, pose.translation() + reach)
        return low, high


def _half_extents(shape, pose: RigidTransform) -> np.ndarray:
    """Returns (3,) how far a primitive at a pose reaches from its centre along the world's axes."""
    R = pose.rotation().matrix()
    axis = np.abs(R[:, 2])
    if isinstance(shape, Box):
        return np.abs(R) @ (np.array(shape.size()) / 2)
    if isinstance(shape, Cylinder):
        across = np.sqrt(np.maximum(0.0, 1.0 - axis**2))
        return axis * shape.length() / 2 + across * shape.radius()
    if isinstance(shape, Capsule):
        return axis * shape.length() / 2 + shape.radius()
    if isinstance(shape, Ellipsoid):
        return np.sqrt(R**2 @ np.array([shape.a(), shape.b(), shape.c()]) ** 2)
    assert isinstance(shape, Sphere)
    return np.full(3, shape.radius())


@pytest.fixture
def robot():
    return load_robot("wheelchair")


@pytest.fixture
def model(robot):
    return WheelchairModel(robot.model_path)


@pytest.mark.parametrize("name", ROBOT_FILES.names)
def test_every_builtin_robot_loads(name):
    assert load_robot(name).description


def test_a_copy_of_a_built_in_robot_finds_the_model_of_the_package_or_one_beside_it(tmp_path):
    copy = tmp_path / "mine.yaml"
    copy.write_bytes((ROBOT_FILES.folder / "wheelchair.yaml").read_bytes())
    assert load_robot(str(copy)).model_path == ROBOT_FILES.folder / "wheelchair.sdf"
    own = tmp_path / "wheelchair.sdf"
    own.write_bytes((ROBOT_FILES.folder / "wheelchair.sdf").read_bytes())
    assert load_robot(str(copy)).model_path == own


def test_half_extents_of_a_tilted_box_reach_its_corners():
    pose = RigidTransform(RollPitchYaw(0.0, 0.0, np.pi / 4), [0.0, 0.0, 0.0])
    # A 2 x 2 m square turned by 45 degrees has its corners at sqrt(2) m on the axes.
    np.testing.assert_allclose(_half_extents(Box(2, 2, 6), pose), [np.sqrt(2), np.sqrt(2), 3])


def test_wheelchair_parses_without_warnings(robot, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        WheelchairModel(robot.model_path)
    assert caplog.records == []


def test_wheelchair_has_rolling_wheels_and_swivelling_casters(model):
    joints = [model.plant.get_joint(JointIndex(i)) for i in range(model.plant.num_joints())]
    axes = {j.name(): j.revolute_axis().tolist() for j in joints if isinstance(j, RevoluteJoint)}
    roll, swivel = [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
    assert axes == {
        "left_wheel_axle": roll,
        "right_wheel_axle": roll,
        "left_caster_swivel": swivel,
        "left_caster_axle": roll,
        "right_caster_swivel": swivel,
        "right_caster_axle": roll,
    }


@pytest.mark.parametrize("angle_rad", CASTER_ANGLES_RAD)
def test_wheelchair_stays_inside_its_footprint_wherever_the_casters_point(robot, model, angle_rad):
    model.turn_casters(angle_rad)
    low, high = model.bounds()
    corners = np.array(robot.footprint)
    assert (low[:2] >= corners.min(axis=0)).all()
    assert (high[:2] <= corners.max(axis=0)).all()


def test_wheelchair_fills_its_footprint(robot, model):
    low, high = model.bounds()
    corners = np.array(robot.footprint)
    np.testing.assert_allclose(low[:2], corners.min(axis=0), atol=0.01)
    np.testing.assert_allclose(high[:2], corners.max(axis=0), atol=0.01)


@pytest.mark.parametrize(
    "link", ["left_wheel", "right_wheel", "left_caster_wheel", "right_caster_wheel"]
)
def test_every_wheel_stands_on_the_floor(model, link):
    body = model.plant.GetBodyByName(link)
    axle_height_m = body.EvalPoseInWorld(model.context).translation()[2]
    inspector = model.scene_graph.model_inspector()
    shapes = [inspector.GetShape(g) for g in model.plant.GetVisualGeometriesForBody(body)]
    largest_radius_m = max(s.radius() for s in shapes if isinstance(s, Cylinder))
    assert axle_height_m == pytest.approx(largest_radius_m)


def test_drive_wheels_turn_about_the_base_origin(model):
    for link, side in (("left_wheel", 1.0), ("right_wheel", -1.0)):
        centre = model.plant.GetBodyByName(link).EvalPoseInWorld(model.context).translation()
        assert centre[0] == 0.0
        assert np.sign(centre[1]) == side


def test_drive_wheel_inertia_is_that_of_a_uniform_cylinder(model):
    mass_kg, radius_m, width_m = 9.0, 0.24, 0.05
    spatial = model.plant.GetBodyByName("left_wheel").default_spatial_inertia()
    assert spatial.get_mass() == mass_kg
    across = mass_kg * (3 * radius_m**2 + width_m**2) / 12
    expected = [across, mass_kg * radius_m**2 / 2, across]
    np.testing.assert_allclose(spatial.CalcRotationalInertia().get_moments(), expected)


def test_wheelchair_weighs_what_a_powered_chair_weighs(model):
    # 48 kg chassis, two drive wheels of 9 kg, two casters of 0.6 + 1.0 kg.
    assert model.plant.CalcTotalMass(model.context) == pytest.approx(48 + 2 * 9 + 2 * 1.6)


def test_wheelchair_has_the_published_settings(robot):
    navigation = robot.navigation
    assert robot.drive.max_linear_velocity_mps == 0.5
    assert navigation.controller_server.failure_tolerance == 0.0
    assert navigation.local_costmap.inflation_layer.inflation_radius == 0.9
    assert (
        navigation.local_costmap.obstacle_layer.observation_sources["scan"].obstacle_max_range
        == 2.95
    )
    front_corner_m = np.hypot(0.85, 0.30)
    assert footprint_radii(robot.outline) == (0.25, pytest.approx(front_corner_m))
