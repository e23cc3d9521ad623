"""The spatio-temporal voxel layer shows what was seen one update later, and forgets it."""

import numpy as np
import pytest

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.kernels.grid import LETHAL
from drake_navbench.kernels.spatio_temporal_voxels import (
    DEPTH_CAMERA,
    LIDAR_3D,
    NO_VOXELS,
    Frustum,
    centres_of,
    is_inside,
    marked,
)
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.navigation.costmaps.layered_costmap import local_layers
from drake_navbench.navigation.costmaps.point_cloud import PointCloud
from drake_navbench.navigation.costmaps.spatio_temporal_layer import means_of_voxels
from drake_navbench.typed_files.typed_yaml import validate

FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
STVL = "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer"
POINT = [1.03, 0.03, 0.5]
CELL = {(20, 10)}


def layers_of(source=None, **parameters):
    """Returns layers of 40 x 20 cells of 0.1 m around the robot; POINT is in CELL."""
    eye = {"obstacle_range": 3.0, **(source or {})}
    layer = {"plugin": STVL, "voxel_decay": 1.0, "observation_sources": {"eye": eye}, **parameters}
    costmap = {"width": 2, "height": 2, "resolution": 0.1, "plugins": ["stvl"], "stvl": layer}
    costmap["width"], costmap["height"] = 4, 2
    settings = validate(LocalCostmapSettings, costmap, "costmap")
    return local_layers(settings, lidar=LidarSettings(), footprint=FOOTPRINT)


def lethal_at(layers, times, *points, seen_until=0.0):
    """Returns the lethal cells after updates at some times; the points are sent until a time."""
    state = layers.initial_state()
    for time_s in times:
        sent = np.array(points, dtype=float).reshape(-1, 3) if time_s <= seen_until else []
        cloud = PointCloud(np.array([0.0, 0.0, 0.5]), np.reshape(sent, (-1, 3)), time_s)
        state = layers.updated(
            state, scan=None, pose=np.zeros(3), time_s=time_s, clouds={"eye": cloud}
        )
    return {(int(c) - 10, int(r)) for r, c in np.argwhere(state.costmap.costs == LETHAL)}


def test_a_mark_shows_at_the_next_update():
    layers = layers_of()
    assert lethal_at(layers, [0.0], POINT) == set()
    assert lethal_at(layers, [0.0, 0.2], POINT) == CELL


def test_a_mark_goes_after_its_decay():
    assert lethal_at(layers_of(), [0.0, 1.0], POINT) == CELL
    assert lethal_at(layers_of(), [0.0, 1.01], POINT) == set()


def test_a_voxel_that_is_seen_again_stays():
    assert lethal_at(layers_of(), [0.0, 0.8, 1.6], POINT, seen_until=0.8) == CELL


def test_a_persistent_voxel_stays():
    assert lethal_at(layers_of(decay_model=-1, voxel_decay=1.0), [0.0, 99.0], POINT) == CELL


def test_a_voxel_in_sight_ages_faster():
    # With an acceleration of 6 / s^2: 0.6 s + (0.6 s)^3 < 1 s < 0.7 s + (0.7 s)^3.
    eye = {"clearing": True, "decay_acceleration": 6.0, "max_z": 3.0}
    assert lethal_at(layers_of(eye), [0.0, 0.6], POINT) == CELL
    assert lethal_at(layers_of(eye), [0.0, 0.7], POINT) == set()
    assert lethal_at(layers_of({**eye, "clearing": False}), [0.0, 0.7], POINT) == CELL
    beside = {**eye, "min_z": 1.5}
    assert lethal_at(layers_of(beside), [0.0, 0.7], POINT) == CELL


def test_a_column_needs_enough_voxels():
    points = [[1.03, 0.03, z] for z in (0.3, 0.4, 0.5)]
    assert lethal_at(layers_of(mark_threshold=3), [0.0, 0.2], *points) == CELL
    assert lethal_at(layers_of(mark_threshold=4), [0.0, 0.2], *points) == set()


@pytest.mark.parametrize(
    ("source", "is_seen"),
    [
        ({"max_obstacle_height": 0.4}, False),
        ({"max_obstacle_height": 0.4, "filter": "none"}, True),
        ({"max_obstacle_height": 0.4, "filter": "voxel"}, False),
        ({"obstacle_range": 1.0}, False),
        ({"marking": False}, False),
        ({"enabled": False}, False),
        ({"filter": "voxel", "voxel_min_points": 2}, False),
    ],
)
def test_which_points_mark(source, is_seen):
    assert (lethal_at(layers_of(source), [0.0, 0.2], POINT) == CELL) is is_seen


def test_while_mapping_nothing_is_shown():
    assert lethal_at(layers_of(mapping_mode=True), [0.0, 0.2], POINT) == set()


def test_readings_that_are_read_once_clear_once():
    """With `clear_after_reading` a cloud that was read no longer shows where the sensor looks."""
    eye = {"clearing": True, "decay_acceleration": 6.0, "max_z": 3.0}

    def lethal(**source):
        layers, state = layers_of({**eye, **source}), None
        state = layers.initial_state()
        for time_s in (0.0, 0.7):
            cloud = PointCloud(np.array([0.0, 0.0, 0.5]), np.array([POINT]), 0.0)
            state = layers.updated(
                state, scan=None, pose=np.zeros(3), time_s=time_s, clouds={"eye": cloud}
            )
        return (state.costmap.costs == LETHAL).any()

    assert lethal(clear_after_reading=True)
    assert not lethal(clear_after_reading=False)


def test_indices_are_cut_toward_zero_after_a_step_down_for_negative_ones():
    points = np.array([[0.07, 0.02, 0.07], [-0.03, 0.02, 0.07], [0.07, -0.03, 0.07]])
    found = marked(NO_VOXELS, np.zeros(3), points, reach=9.0, voxel_size=0.05, now=0.0)
    centres = sorted(map(tuple, np.round(centres_of(found.keys, 0.05), 3).tolist()))
    # Of the last one, at a negative y, z is a voxel too low, as in the original.
    assert centres == [(-0.025, 0.025, 0.075), (0.075, -0.025, 0.025), (0.075, 0.025, 0.075)]


def frustum(model, **fields):
    """Returns what a sensor at the origin that looks along x sees."""
    values = {
        "origin": np.zeros(3), "yaw": 0.0, "pitch": 0.0, "horizontal_fov": 1.0,
        "vertical_fov": 0.6, "padding": 0.0, "near": 0.5, "far": 2.0, "acceleration": 0.0,
    }  # fmt: skip
    return Frustum(model, **(values | fields))


@pytest.mark.parametrize("model", [DEPTH_CAMERA, LIDAR_3D])
def test_a_frustum_ends_at_its_angles_and_ranges(model):
    def sees(x, y, z, **fields):
        return bool(is_inside(frustum(model, **fields), np.array([[x, y, z]]))[0])

    assert sees(1.0, 0.0, 0.0)
    assert not sees(0.4, 0.0, 0.0)
    assert not sees(2.1, 0.0, 0.0)
    assert sees(1.0, 0.5, 0.0)
    assert not sees(1.0, 0.6, 0.0)
    assert sees(1.0, 0.0, 0.28)
    assert not sees(1.0, 0.0, -0.35)
    assert sees(0.0, 1.0, 0.0, yaw=0.5 * np.pi)
    assert not sees(-1.0, 0.0, 0.0)
    assert sees(0.9, 0.0, -0.45, pitch=0.45)
    assert not sees(0.9, 0.0, -0.45)


def test_a_lidar_that_looks_all_around_sees_behind_itself():
    behind = np.array([[-1.0, 0.0, 0.0]])
    assert is_inside(frustum(LIDAR_3D, horizontal_fov=6.28), behind)[0]


def test_the_points_of_a_voxel_become_their_mean():
    points = np.array([[0.01, 0.01, 0.01], [0.03, 0.01, 0.01], [0.06, 0.01, 0.01]])
    np.testing.assert_allclose(
        means_of_voxels(points, 0.05, 0), [[0.02, 0.01, 0.01], [0.06, 0.01, 0.01]]
    )
    np.testing.assert_allclose(means_of_voxels(points, 0.05, 2), [[0.02, 0.01, 0.01]])
