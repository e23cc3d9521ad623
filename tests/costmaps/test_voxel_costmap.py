"""The voxel layer in a costmap: its sources, its place among the layers."""

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.kernels.scan import Scan
from drake_navbench.kernels.voxel_layer import UNKNOWN_COLUMN
from drake_navbench.navigation.costmaps.costmap_settings import (
    GlobalCostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.navigation.costmaps.layered_costmap import (
    GridGeometry,
    LayeredCostmap,
    local_layers,
)
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import OCCUPIED
from drake_navbench.navigation.costmaps.observation_layers import VoxelLayerParameters
from drake_navbench.navigation.costmaps.observation_source import ObservationSourceSettings
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.typed_files.typed_yaml import validate

FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
POSE = np.zeros(3)
ANGLES = np.array([0.0, 0.5 * np.pi])
LIDAR = LidarSettings(height_m=0.3)
SCAN_SOURCE = {"clearing": True, "max_obstacle_height": 2.0}
CAMERA_SOURCE = {"data_type": "PointCloud2", "max_obstacle_height": 1.0}


def scan_of(*ranges, pose=POSE):
    """Returns a scan with one beam ahead and one to the left."""
    return Scan(0.0, pose, ANGLES, np.array(ranges, dtype=np.float32))


def local(plugins=("voxel_layer",), lidar=LIDAR, **settings):
    """Layers of 20 x 20 cells of 0.1 m; the robot at (0, 0) is in the lower left corner of one."""
    costmap = LocalCostmapSettings(
        width=2, height=2, resolution=0.1, plugins=list(plugins), **settings
    )
    return local_layers(costmap, lidar=lidar, footprint=FOOTPRINT)


def costs_after(layers, *scans, pose=POSE, clouds=None):
    """Returns the costs after an update with each scan; row and column 10 begin at (0, 0)."""
    state = layers.initial_state()
    for scan in scans:
        state = layers.updated(state, scan=scan, pose=pose, time_s=0.0, clouds=clouds or {})
    return state.costmap.costs


def cells(costs, cost=LETHAL):
    """Returns the cells (column, row) of a cost."""
    return {(int(column), int(row)) for row, column in np.argwhere(costs == cost)}


def test_a_scan_marks_the_level_of_the_lidar():
    layers = local()
    state = layers.updated(
        layers.initial_state(), scan=scan_of(0.55, np.inf), pose=POSE, time_s=0.0
    )
    assert cells(state.costmap.costs) == {(15, 10)}
    # 0.3 m is on the second level of 0.2 m.
    assert state.layers["voxel_layer"].voxels[10, 15] == UNKNOWN_COLUMN | 1 << 17


def test_marks_are_inflated_like_those_of_other_layers():
    layers = local(
        plugins=("voxel_layer", "inflation_layer"), inflation_layer={"inflation_radius": 0.3}
    )
    costs = costs_after(layers, scan_of(0.55, np.inf))
    assert costs[10, 14:17].tolist() == [INSCRIBED, LETHAL, INSCRIBED]


def test_without_a_voxel_layer_there_are_no_voxels():
    assert "voxel_layer" not in local(plugins=("obstacle_layer",)).initial_state().layers
    assert "voxel_layer" not in local(voxel_layer={"enabled": False}).initial_state().layers


@pytest.mark.parametrize("height_m", [-0.1, 2.0])
def test_a_lidar_above_or_below_the_grid_marks_nothing(height_m):
    layers = local(lidar=LidarSettings(height_m=height_m))
    assert not costs_after(layers, scan_of(0.55, 0.75)).any()


def test_a_source_with_nav2s_defaults_loses_the_points_of_a_raised_lidar():
    layers = local(voxel_layer={"observation_sources": {"scan": {}}})
    assert not costs_after(layers, scan_of(0.55, 0.75)).any()
    on_the_floor = local(
        lidar=LidarSettings(height_m=0.0), voxel_layer={"observation_sources": {"scan": {}}}
    )
    assert cells(costs_after(on_the_floor, scan_of(0.55, 0.75))) == {(15, 10), (10, 17)}


def test_a_camera_shows_what_the_lidar_does_not():
    layers = local(voxel_layer={"observation_sources": {"scan": SCAN_SOURCE, "eye": CAMERA_SOURCE}})
    # A step on the floor, a lamp, and one that hangs too high for the source.
    points = np.array([[0.45, 0.05, 0.05], [0.45, 0.25, 0.9], [0.45, 0.45, 1.1]])
    clouds = {"eye": PointCloud(np.array([0.0, 0.0, 0.8]), points)}
    # The lidar's ray passes above the step, and clears its own level only.
    costs = costs_after(layers, scan_of(0.85, np.inf), clouds=clouds)
    assert cells(costs) == {(14, 10), (14, 12), (18, 10)}


def test_a_cloud_of_no_source_is_not_looked_at():
    clouds = {"ear": PointCloud(np.zeros(3), np.array([[0.45, 0.05, 0.05]]))}
    assert not costs_after(local(), scan_of(np.inf, np.inf), clouds=clouds).any()


def test_sources_may_share_the_scan():
    sources = {
        "near": {**SCAN_SOURCE, "obstacle_max_range": 0.5},
        "far": {**SCAN_SOURCE, "marking": False, "inf_is_valid": True},
    }
    layers = local(voxel_layer={"observation_sources": sources})
    assert cells(costs_after(layers, scan_of(0.45, 0.75))) == {(14, 10)}
    assert not costs_after(layers, scan_of(0.45, 0.75), scan_of(np.inf, 0.75)).any()


def test_a_mark_within_two_cells_of_a_later_hit_stays_unlike_in_the_obstacle_layer():
    scans = scan_of(0.55, np.inf), scan_of(0.65, np.inf)
    assert cells(costs_after(local(), *scans)) == {(15, 10), (16, 10)}
    assert cells(costs_after(local(plugins=("obstacle_layer",)), *scans)) == {(16, 10)}


def test_unknown_columns_stay_unknown_where_too_few_levels_were_seen():
    # One of ten levels is seen; six levels that are not there do not count.
    strict = {"unknown_threshold": 8}
    tracking = {"track_unknown_space": True, "filters": []}
    for parameters, cost in ((strict, NO_INFORMATION), ({"unknown_threshold": 9}, FREE)):
        costs = costs_after(local(voxel_layer=parameters, **tracking), scan_of(0.85, np.inf))
        assert costs[10, 14] == cost


def test_clearing_a_costmap_forgets_its_voxels():
    layers = local()
    state = layers.updated(layers.initial_state(), scan=scan_of(0.55, 0.75), pose=POSE, time_s=0.0)
    nothing = scan_of(np.inf, np.inf)
    again = layers.updated(layers.cleared(state), scan=nothing, pose=POSE, time_s=1.0)
    assert (state.layers["voxel_layer"].voxels != UNKNOWN_COLUMN).any()
    np.testing.assert_array_equal(again.layers["voxel_layer"].voxels, UNKNOWN_COLUMN)


def test_voxels_follow_the_window():
    layers = local()
    state = layers.updated(
        layers.initial_state(), scan=scan_of(0.55, np.inf), pose=POSE, time_s=0.0
    )
    nothing = scan_of(np.inf, np.inf)
    moved = np.array([0.3, -0.2, 0.0])
    after = layers.updated(state, scan=nothing, pose=moved, time_s=1.0).layers["voxel_layer"].voxels
    # The mark of column 15, row 10: the window has moved three columns right and a row down, since
    # moves are truncated to whole cells.
    assert np.argwhere(after >> 16).tolist() == [[11, 12]]


def test_it_writes_beside_an_obstacle_layer():
    near = {"observation_sources": {"scan": SCAN_SOURCE | {"obstacle_max_range": 0.7}}}
    both = local(plugins=("obstacle_layer", "voxel_layer"), obstacle_layer=near)
    assert cells(costs_after(both, scan_of(0.55, 0.75))) == {(15, 10), (10, 17)}


def test_a_costmap_that_stays_is_updated_where_the_voxel_layer_was_touched():
    occupancy = np.zeros((20, 40), dtype=np.int8)
    occupancy[5, 35] = OCCUPIED
    known = OccupancyMap(occupancy, 0.1, -1.0, -1.0)
    settings = GlobalCostmapSettings(plugins=["static_layer", "voxel_layer"], filters=[])
    layers = LayeredCostmap(
        settings, GridGeometry.of_map(known), lidar=LIDAR, footprint=FOOTPRINT, static_map=known
    )
    before = layers.updated(layers.initial_state(), scan=None, pose=POSE, time_s=0.0)
    assert cells(before.costmap.costs) == {(35, 5)}
    after = layers.updated(before, scan=scan_of(0.55, np.inf), pose=POSE, time_s=0.2)
    assert cells(after.costmap.costs) == {(35, 5), (15, 10)}


# Settings


def test_a_lidar_above_the_layers_that_are_there_from_the_start_is_told():
    high = {"description": "r", "robot_radius": 0.3, "lidar": {"height_m": 2.5}}
    with pytest.raises(InputError, match="obstacle_layer: sees up to 2 m, and the lidar"):
        validate(Robot, high, "robot.yaml")


def test_bringups_scan_is_the_source_by_default():
    source = VoxelLayerParameters().observation_sources["scan"]
    assert source == ObservationSourceSettings(clearing=True, max_obstacle_height=2.0)


@pytest.mark.parametrize(
    ("layer", "message"),
    [
        ({"z_voxels": 17}, "z_voxels"),
        ({"z_resolution": 0.0}, "z_resolution"),
        ({"mark_threshold": -1}, "mark_threshold"),
        ({"observation_sources": {"eye": CAMERA_SOURCE}}, "eye: the robot has no depth sensor"),
        ({"observation_sources": {"scan": {"data_type": "Sonar"}}}, "data_type"),
    ],
)
def test_wrong_settings_are_one_line(layer, message):
    navigation = {"local_costmap": {"plugins": ["voxel_layer"], "voxel_layer": layer}}
    robot = {"description": "round", "robot_radius": 0.2, "navigation": navigation}
    with pytest.raises(InputError) as caught:
        validate(Robot, robot, "robot.yaml")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_camera_that_no_costmap_asks_for_does_no_harm():
    layer = {"observation_sources": {"eye": CAMERA_SOURCE}}
    navigation = {"local_costmap": {"voxel_layer": layer}}
    robot = Robot(description="round", robot_radius=0.2, navigation=navigation)
    assert robot.depth_sensors == {}


def test_a_window_of_the_releases_before_lyrical_lies_a_quarter_cell_off():
    # The robot at 0.12 m: 1.2 cells from the first window's middle, 1.45 with the quarter; at
    # 0.18 m 1.8 and 2.05.
    def origin_at(x, release):
        layers = local(nav2_release=release)
        pose = np.array([x, 0.0, 0.0])
        scan = scan_of(0.55, np.inf, pose=pose)
        return layers.updated(layers.initial_state(), scan=scan, pose=pose, time_s=0.0).origin[0]

    for x, moved in ((0.12, False), (0.18, True)):
        cells_moved = round((origin_at(x, "kilted") - origin_at(x, "lyrical")) / 0.1)
        assert cells_moved == int(moved)


@pytest.mark.parametrize(("release", "cost"), [("kilted", 135), ("lyrical", 136)])
def test_the_inflation_follows_the_release(release, cost):
    inflation = {"inflation_radius": 0.9, "cost_scaling_factor": 15.0}
    layers = local(
        plugins=("voxel_layer", "inflation_layer"), nav2_release=release, inflation_layer=inflation
    )
    costs = costs_after(layers, scan_of(0.55, np.inf))
    ((row, column),) = np.argwhere(costs == LETHAL)
    # A cell off along both sides: 252 exp(-15 (0.1 sqrt(2) - 0.1)), with 1.41 for the root.
    assert costs[row + 1, column + 1] == cost


@pytest.mark.parametrize("release", ["humble", "iron", "jazzy", "kilted", "lyrical"])
def test_a_point_at_the_range_of_marking_marks_but_in_iron_and_kilted(release):
    sources = {
        "observation_sources": {"scan": {"obstacle_max_range": 0.5, "max_obstacle_height": 2.0}}
    }
    layers = local(plugins=("obstacle_layer",), nav2_release=release, obstacle_layer=sources)
    marks = np.any(costs_after(layers, scan_of(0.5, np.inf)) == LETHAL)
    assert marks == (release not in {"iron", "kilted"})
