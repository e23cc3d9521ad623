"""Speed of the lidar and of the costmap layers. Run with --benchmark-only."""

import numpy as np
import pytest

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.kernels.footprint import circle_footprint, footprint_cost
from drake_navbench.kernels.grid import LETHAL, Grid
from drake_navbench.kernels.inflation import inflate
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import scan_points, update_obstacle_layer
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.rasterize import mark_polygon
from drake_navbench.kernels.ray_casting import cast_rays
from drake_navbench.kernels.scan import Scan
from drake_navbench.kernels.voxel_layer import UNKNOWN_COLUMN, update_voxel_layer, voxel_grid
from drake_navbench.navigation.costmaps.costmap_settings import (
    GlobalCostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layered_costmap import GridGeometry, LayeredCostmap
from drake_navbench.navigation.costmaps.map_file import OccupancyMap

BEAMS = np.linspace(-np.pi, np.pi, 360, endpoint=False)
FOOTPRINT = circle_footprint(0.3)
INFLATION = {
    "resolution": 0.05,
    "inscribed_radius": 0.28,
    "inflation_radius": 0.9,
    "cost_scaling_factor": 3.0,
}


def walls(size, *, specks=0):
    """A map with a few walls and, at random places, single obstacle cells."""
    costs = np.zeros((size, size), dtype=np.uint8)
    costs[size // 3, : size // 2] = LETHAL
    costs[size // 2 :, size // 4] = LETHAL
    costs[size // 5, size // 3 :] = LETHAL
    generator = np.random.default_rng(0)
    costs[generator.integers(0, size, specks), generator.integers(0, size, specks)] = LETHAL
    return costs


def scan_of_a_room(half_width):
    ranges = half_width / np.maximum(np.abs(np.cos(BEAMS)), np.abs(np.sin(BEAMS)))
    return ranges + 0.01 * np.sin(7 * BEAMS)


def update(costs):
    pose = np.array([0.3, 0.1, 0.2])
    half = 0.5 * costs.shape[0] * 0.05
    grid = Grid(costs.copy(), 0.3 - half, 0.1 - half, 0.05)
    points = scan_points(
        pose, BEAMS, scan_of_a_room(0.8 * half), height=0.0, range_min=0.1, range_max=12.0
    )
    seen = seen_from(np.array([0.3, 0.1, 0.0]), points)
    update_obstacle_layer(grid, [seen], outline=place_outline(FOOTPRINT, pose))
    return grid.costs


def seen_from(origin, points):
    return Observation(origin, points, True, True, 0.0, 2.5, 0.0, 3.0)


def test_scan_of_360_beams_against_100_segments(benchmark):
    generator = np.random.default_rng(0)
    starts = generator.uniform(-8.0, 8.0, (100, 2))
    segments = np.hstack([starts, starts + generator.normal(size=(100, 2))])
    ranges = benchmark(cast_rays, np.zeros(2), BEAMS, segments, np.empty((0, 3)), 12.0)
    assert np.isfinite(ranges).sum() > 100


@pytest.mark.parametrize("size", [60, 120])
def test_obstacle_layer_takes_a_scan(benchmark, size):
    result = benchmark(update, walls(size))
    assert np.any(result == LETHAL)


@pytest.mark.parametrize("size", [60, 120])
def test_voxel_layer_takes_a_scan(benchmark, size):
    costs = np.zeros((size, size), dtype=np.uint8)
    voxels = np.full((size, size), UNKNOWN_COLUMN, dtype=np.uint32)
    middle = np.array([0.5, 0.5, 0.0]) * size * 0.05
    ranges = 1.0 + 2.0 * np.random.default_rng(0).random(BEAMS.size)
    points = middle + ranges[:, None] * np.column_stack(
        [np.cos(BEAMS), np.sin(BEAMS), np.zeros(BEAMS.size)]
    )
    scan = seen_from(middle, points)
    outline = place_outline(FOOTPRINT, middle)

    def update_copies():
        grid = voxel_grid(Grid(costs.copy(), 0.0, 0.0, 0.05), voxels.copy())
        update_voxel_layer(grid, [scan], outline=outline)
        return grid.costs

    assert np.any(benchmark(update_copies) == LETHAL)


@pytest.mark.parametrize(("size", "specks"), [(120, 0), (120, 60), (1000, 0), (1000, 1000)])
def test_inflation(benchmark, size, specks):
    costs = walls(size, specks=specks)
    inflated = benchmark(inflate, costs, **INFLATION)
    assert inflated.sum() > costs.sum()


def test_footprint_of_16_vertices(benchmark):
    costs = np.zeros((120, 120), dtype=np.uint8)
    assert (
        benchmark(footprint_cost, Grid(costs, 0.0, 0.0, 0.05), FOOTPRINT, 3.0, 3.0, 0.3, True) == 0
    )


def test_polygon_on_a_large_map(benchmark):
    costs = np.zeros((1000, 1000), dtype=np.uint8)
    angles = np.linspace(0.0, 6.0, 40)
    star = 25.0 + (15.0 + 5.0 * (np.arange(40) % 2))[:, None] * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    benchmark(mark_polygon, Grid(costs, 0.0, 0.0, 0.05), star)
    assert costs.any()


@pytest.mark.parametrize("size", [60, 120])
def test_update_of_a_local_costmap_with_every_layer_and_filter(benchmark, size):
    occupancy = np.where(walls(1000) == LETHAL, 100, 0).astype(np.int8)
    known = OccupancyMap(occupancy, 0.05, -25.0, -25.0)
    settings = LocalCostmapSettings(
        inflation_layer={"inflation_radius": 0.9, "cost_scaling_factor": 3.0},
        plugins=["static_layer", "obstacle_layer", "denoise_layer", "inflation_layer"],
    )
    layers = LayeredCostmap(
        settings,
        GridGeometry(size, size, 0.0, 0.0, 0.05, rolling_window=True),
        lidar=LidarSettings(),
        footprint=FOOTPRINT,
        static_map=known,
        masks=[FilterMask("keepout", known)],
    )
    pose = np.array([0.3, 0.1, 0.2])
    scan = Scan(0.0, pose, BEAMS, scan_of_a_room(0.4 * size * 0.05).astype(np.float32))
    state = layers.updated(layers.initial_state(), scan=scan, pose=pose, time_s=0.0)
    state = benchmark(layers.updated, state, scan=scan, pose=pose, time_s=0.0)
    assert state.costmap.costs.any()


def test_update_of_a_global_costmap_of_a_large_map(benchmark):
    occupancy = np.where(walls(1000) == LETHAL, 100, 0).astype(np.int8)
    known = OccupancyMap(occupancy, 0.05, -25.0, -25.0)
    settings = GlobalCostmapSettings(
        inflation_layer={"inflation_radius": 0.9, "cost_scaling_factor": 3.0}
    )
    layers = LayeredCostmap(
        settings,
        GridGeometry.of_map(known),
        lidar=LidarSettings(),
        footprint=FOOTPRINT,
        static_map=known,
    )
    pose = np.array([0.3, 0.1, 0.2])
    scan = Scan(0.0, pose, BEAMS, scan_of_a_room(3.0).astype(np.float32))
    state = layers.updated(layers.initial_state(), scan=None, pose=pose, time_s=0.0)
    state = benchmark(layers.updated, state, scan=scan, pose=pose, time_s=0.0)
    assert state.costmap.costs.any()
