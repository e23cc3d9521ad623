"""Layers with sources of any kind: scans, clouds, several of both, and what they remember."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.grid import FREE, LETHAL
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.typed_files.typed_yaml import validate

FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
ANGLES = np.linspace(-np.pi, np.pi, 40, endpoint=False)
OBSTACLES, VOXELS = "nav2_costmap_2d::ObstacleLayer", "nav2_costmap_2d::VoxelLayer"
SCAN = {"clearing": True, "max_obstacle_height": 2.0}
CLOUD = {"data_type": "PointCloud2", "max_obstacle_height": 2.0}


def layers_of(*plugins, further=(), **blocks):
    """Returns layers of 60 x 60 cells of 0.1 m."""
    costmap = {"width": 6, "height": 6, "resolution": 0.1, "plugins": list(plugins), **blocks}
    settings = validate(LocalCostmapSettings, costmap, "costmap")
    lidar = LidarSettings(height_m=0.3, further_poses=further)
    return local_layers(settings, lidar=lidar, footprint=FOOTPRINT)


def block(plugin, **sources):
    """Returns a layer's block with sources."""
    return {"plugin": plugin, "observation_sources": sources}


def scan_at(pose, time_s, seed):
    """Returns a scan of random ranges."""
    ranges = np.random.default_rng(seed).uniform(0.5, 4.0, ANGLES.size).astype(np.float32)
    return Scan(time_s, np.array(pose), ANGLES, ranges)


def cloud_of(*points, time_s=0.0):
    """Returns a cloud of a sensor at 0.5 m."""
    return PointCloud(np.array([0.0, 0.0, 0.5]), np.array(points, dtype=float), time_s)


def driven(layers, clouds=None, steps=6):
    """Returns the costs of every update of a drive with random scans."""
    state, costs = layers.initial_state(), []
    for step in range(steps):
        pose = np.array([0.13 * step, 0.05 * step, 0.1 * step])
        state = layers.updated(
            state,
            scan=scan_at(pose, 0.2 * step, step),
            pose=pose,
            time_s=0.2 * step,
            clouds=clouds or {},
        )
        costs.append(state.costmap.costs)
    return np.array(costs)


def lethal_after(layers, *updates):
    """Returns the lethal cells (column, row) after updates (clouds by name, time s)."""
    state = layers.initial_state()
    for clouds, time_s in updates:
        state = layers.updated(state, scan=None, pose=np.zeros(3), time_s=time_s, clouds=clouds)
    return {(int(c), int(r)) for r, c in np.argwhere(state.costmap.costs == LETHAL)}


@pytest.mark.parametrize(
    ("plugin", "name", "own"),
    [(OBSTACLES, "obstacle_layer", {}), (VOXELS, "voxel_layer", {})],
)
def test_with_one_scan_a_block_is_the_costmaps_own_layer(plugin, name, own):
    assert (driven(layers_of("mine", mine=block(plugin, scan=SCAN))) == LETHAL).any()
    np.testing.assert_array_equal(
        driven(layers_of("mine", mine=block(plugin, scan=SCAN))),
        driven(layers_of(name, **{name: own})),
    )


def test_two_layers_of_a_type_both_write():
    layers = layers_of(
        "low",
        "high",
        low=block(VOXELS, a=CLOUD),
        high=block(VOXELS, b=CLOUD),
    )
    clouds = {"a": cloud_of([1.05, 0.05, 0.1]), "b": cloud_of([0.05, 1.05, 1.0])}
    assert lethal_after(layers, (clouds, 0.0)) == {(40, 30), (30, 40)}


@pytest.mark.parametrize(("height", "is_seen"), [(0.05, False), (0.1, True), (0.8, False)])
def test_points_outside_of_a_sources_heights_are_not_looked_at(height, is_seen):
    source = {**CLOUD, "min_obstacle_height": 0.1, "max_obstacle_height": 0.7}
    layers = layers_of("eye", eye=block(OBSTACLES, eye=source))
    assert bool(lethal_after(layers, ({"eye": cloud_of([1.05, 0.05, height])}, 0.0))) is is_seen


def test_a_layers_own_heights_keep_points_from_marking_but_not_from_clearing():
    eye = {**CLOUD, "clearing": True}
    layers = layers_of("eye", eye={**block(OBSTACLES, eye=eye), "min_obstacle_height": 0.2})
    obstacle = {"eye": cloud_of([1.05, 0.05, 0.5])}
    floor = {"eye": cloud_of([2.05, 0.05, 0.0], time_s=0.1)}
    assert lethal_after(layers, (obstacle, 0.0)) == {(40, 30)}
    assert lethal_after(layers, (obstacle, 0.0), (floor, 0.1)) == set()


def test_a_source_that_only_marks_forgets_nothing():
    layers = layers_of("eye", eye=block(OBSTACLES, eye=CLOUD))
    near, far = cloud_of([1.05, 0.05, 0.5]), cloud_of([2.05, 0.05, 0.5], time_s=0.1)
    assert lethal_after(layers, ({"eye": near}, 0.0), ({"eye": far}, 0.1)) == {(40, 30), (50, 30)}


def test_a_persistent_source_marks_again_what_was_cleared():
    eye = {**CLOUD, "clearing": True, "observation_persistence": 0.5}
    layers = layers_of("eye", eye=block(OBSTACLES, eye=eye))
    near, far = cloud_of([1.05, 0.05, 0.5]), cloud_of([2.05, 0.05, 0.5], time_s=0.2)
    seen = [({"eye": near}, 0.0), ({"eye": far}, 0.2)]
    assert lethal_after(layers, *seen) == {(40, 30), (50, 30)}
    # After half a second the first cloud is too old, and the ray to the second one is free.
    assert lethal_after(layers, *seen, ({"eye": far}, 0.6)) == {(50, 30)}


def test_a_source_may_be_one_of_several_scanners():
    first, second = scan_at((0.0, 0.0, 0.0), 0.0, 1), scan_at((0.0, 0.0, 0.0), 0.0, 2)
    both = Scan(0.0, first.sensor_pose, ANGLES, first.ranges_m, further=(second,))

    def costs(scan, **source):
        layers = layers_of("s", further=((0, 0, 0),), s=block(OBSTACLES, s={**SCAN, **source}))
        state = layers.updated(layers.initial_state(), scan=scan, pose=np.zeros(3), time_s=0.0)
        return state.costmap.costs

    np.testing.assert_array_equal(costs(both, scanner=2), costs(second))
    np.testing.assert_array_equal(costs(both, scanner=1), costs(first))
    assert (costs(both) != costs(first)).any()


def test_clearing_the_costmap_forgets_the_layer():
    layers = layers_of("eye", eye=block(VOXELS, eye=CLOUD))
    state = layers.updated(
        layers.initial_state(),
        scan=None,
        pose=np.zeros(3),
        time_s=0.0,
        clouds={"eye": cloud_of([1.05, 0.05, 0.5])},
    )
    after = layers.updated(layers.cleared(state), scan=None, pose=np.zeros(3), time_s=0.1)
    assert (after.costmap.costs == FREE).all()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (CLOUD, "eye.observation_sources.eye: the robot has no depth sensor 'eye'"),
        ({**CLOUD, "sensor": "oak"}, "no depth sensor 'oak'; did you mean 'oaks'?"),
        ({"scanner": 2}, "eye.scanner: got 2, the robot has 1"),
        ({"sensor": "oaks"}, "sensor: got 'oaks', expected data_type PointCloud2 with it"),
        ({**CLOUD, "observation_persistence": -1.0}, "observation_persistence"),
    ],
)
def test_a_source_without_its_sensor_is_one_line(source, message):
    robot = {
        "description": "round",
        "robot_radius": 0.2,
        "depth_sensors": {"oaks": {}},
        "navigation": {"local_costmap": {"plugins": ["eye"], "eye": block(OBSTACLES, eye=source)}},
    }
    with pytest.raises(InputError) as caught:
        validate(Robot, robot, "robot.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
