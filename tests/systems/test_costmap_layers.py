"""The layers and filters of costmaps, by hand-computed grids, in a Diagram that is stepped."""

from dataclasses import replace

import numpy as np
import pytest
from costmap_rig import Rig
from pydrake.systems.analysis import Simulator

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.world import Box, World
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL, NO_INFORMATION
from drake_navbench.kernels.scan import Scan
from drake_navbench.navigation.costmaps.costmap_settings import (
    GlobalCostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.navigation.costmaps.filter_masks import FilterMask
from drake_navbench.navigation.costmaps.layered_costmap import GridGeometry, LayeredCostmap
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import OCCUPIED, UNKNOWN
from drake_navbench.navigation.task import ClearRequest
from drake_navbench.trial.systems.costmap_system import CostmapSystem
from drake_navbench.trial.systems.global_costmap import GlobalCostmap
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.local_costmap import LocalCostmap

# A square of 0.2 m: it covers the cells of 0.1 m within 0.1 m of the robot.
FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
EMPTY = World(())
WALL = World((Box(type="box", min=(0.75, -0.3), max=(0.85, 0.3)),))
# Costs at distances of 0 to 3 cells of 0.1 m, inscribed radius 0.1 m, scaling 10:
# 252 exp(-10 * 0.1) = 92.7, 252 exp(-10 * 0.2) = 34.1.
PROFILE = [LETHAL, INSCRIBED, 92, 34]


def signs(picture: list[str]) -> np.ndarray:
    """Returns int8 occupancy from rows of '#', '.' and '?', the top row first."""
    values = {"#": OCCUPIED, ".": 0, "?": UNKNOWN}
    return np.array([[values[s] for s in row] for row in reversed(picture)], dtype=np.int8)


def costmap_after_one_update(costmap: CostmapSystem, world=EMPTY, pose=(0.0, 0.0, 0.0)):
    """Returns the output of a costmap system that a lidar feeds."""
    return Rig(costmap, world, pose).after(0.05)


def local(static=None, masks=(), origin=(-0.5, -0.5), **settings):
    """A local costmap of 10 x 10 cells of 0.1 m, the robot at (0, 0) in the middle."""
    grid = None if static is None else OccupancyMap(static, 0.1, *origin)
    return LocalCostmap(
        LocalCostmapSettings(
            **{
                "width": 1,
                "height": 1,
                "resolution": 0.1,
                "inflation_layer": {"inflation_radius": 0.3, "cost_scaling_factor": 10.0},
            }
            | settings
        ),
        LidarSettings(),
        footprint=FOOTPRINT,
        offset_s=0.01,
        static_map=grid,
        masks=masks,
    )


def one_occupied(row=8, column=8, value=OCCUPIED) -> np.ndarray:
    occupancy = np.zeros((10, 10), dtype=np.int8)
    occupancy[row, column] = value
    return occupancy


def test_the_static_layer_shows_the_maps_cells():
    occupancy = one_occupied()
    occupancy[:, 0] = UNKNOWN
    costs = costmap_after_one_update(local(occupancy, plugins=["static_layer"])).costs
    expected = np.zeros((10, 10))
    expected[8, 8] = LETHAL
    np.testing.assert_array_equal(costs, expected)
    tracking = local(occupancy, plugins=["static_layer"], track_unknown_space=True)
    expected[:, 0] = NO_INFORMATION
    np.testing.assert_array_equal(costmap_after_one_update(tracking).costs, expected)


def test_a_map_that_ends_within_the_window_leaves_the_rest_as_it_was():
    corner = np.full((2, 2), OCCUPIED, dtype=np.int8)
    costmap = local(corner, plugins=["static_layer"], track_unknown_space=True)
    costs = costmap_after_one_update(costmap).costs
    assert (costs[:2, :2] == LETHAL).all()
    assert np.count_nonzero(costs == NO_INFORMATION) == 100 - 4


def test_an_occupied_cell_is_inflated_by_the_profile_of_its_distance():
    costs = costmap_after_one_update(
        local(one_occupied(8, 5), plugins=["static_layer", "inflation_layer"])
    ).costs
    np.testing.assert_array_equal(costs[8, 5:9], PROFILE)
    np.testing.assert_array_equal(costs[8:4:-1, 5], PROFILE)
    # Diagonally, one cell is sqrt(2) * 0.1 m: 252 exp(-10 * (0.141 - 0.1)) = 166.7 with the
    # distance rounded to 1.41 cells: 252 exp(-0.41) = 167.2.
    assert costs[9, 6] == 167
    # Four cells away nothing.
    assert costs[8, 9] == FREE
    assert costs[4, 5] == FREE


def test_denoise_frees_the_single_cell_and_keeps_the_pair_before_they_are_inflated():
    picture = signs(["#........."] + [".........."] * 7 + ["........##", ".........."])
    costs = costmap_after_one_update(
        local(picture, plugins=["static_layer", "denoise_layer", "inflation_layer"])
    ).costs
    assert not costs[7:, :3].any()
    np.testing.assert_array_equal(costs[1, :5:-1], [LETHAL, LETHAL, INSCRIBED, 92])


def test_after_the_inflation_denoise_comes_too_late():
    # The inscribed ring makes a group of the single cell.
    layers = ["static_layer", "inflation_layer", "denoise_layer"]
    costs = costmap_after_one_update(local(one_occupied(), plugins=layers)).costs
    assert costs[8, 8] == LETHAL


@pytest.mark.parametrize(("method", "expected"), [(0, FREE), (1, LETHAL), (2, LETHAL)])
def test_free_space_that_is_seen_erases_the_map_only_where_it_overwrites(method, expected):
    costmap = local(
        one_occupied(5, 8),  # at (0.35, 0.05), between the robot and the wall
        plugins=["static_layer", "obstacle_layer"],
        track_unknown_space=True,
        obstacle_layer={"combination_method": method},
    )
    assert costmap_after_one_update(costmap, WALL).costs[5, 8] == expected


@pytest.mark.parametrize(("method", "expected"), [(0, FREE), (1, FREE), (2, NO_INFORMATION)])
def test_free_space_that_is_seen_replaces_unknown_cells_unless_they_are_kept(method, expected):
    costmap = local(
        np.full((10, 10), UNKNOWN, dtype=np.int8),
        plugins=["static_layer", "obstacle_layer"],
        track_unknown_space=True,
        obstacle_layer={"combination_method": method},
    )
    assert costmap_after_one_update(costmap, WALL).costs[5, 8] == expected


def test_the_footprint_frees_the_map_for_as_long_as_the_robot_stands_there():
    def cell_under_robot(**static_layer):
        costmap = local(one_occupied(5, 5), plugins=["static_layer"], static_layer=static_layer)
        return costmap_after_one_update(costmap).costs[5, 5]

    assert cell_under_robot() == LETHAL
    assert cell_under_robot(footprint_clearing_enabled=True) == FREE


def on_the_maps_grid(occupied, **settings):
    """Returns the layers of a costmap on a map of 1 m x 1 m about the origin, and their state."""
    settings = GlobalCostmapSettings(
        filters=[], inflation_layer={"inflation_radius": 0.0}, **settings
    )
    map_ = OccupancyMap(occupied, 0.1, -0.5, -0.5)
    layers = LayeredCostmap(
        settings,
        GridGeometry.of_map(map_),
        lidar=LidarSettings(),
        footprint=FOOTPRINT,
        static_map=map_,
    )
    return layers, layers.initial_state()


@pytest.mark.parametrize("restored", [True, False])
def test_on_the_maps_own_grid_the_static_layer_frees_the_robot_only_with_the_whole_map(restored):
    layers, state = on_the_maps_grid(
        np.full((10, 10), OCCUPIED, dtype=np.int8),
        plugins=["static_layer"],
        static_layer={"footprint_clearing_enabled": True, "restore_cleared_footprint": restored},
    )

    def freed(state):
        return sorted(np.argwhere(state.costmap.grid.costs == FREE)[:, 1])

    # From x = -0.35 to -0.15 m lie parts of the columns 1 to 3.
    state = layers.updated(state, scan=None, pose=np.array([-0.25, 0.0, 0.0]), time_s=0.0)
    assert set(freed(state)) == {1, 2, 3}
    state = layers.updated(state, scan=None, pose=np.array([0.25, 0.0, 0.0]), time_s=0.2)
    assert set(freed(state)) == {1, 2, 3}
    state = layers.cleared(state)
    state = layers.updated(state, scan=None, pose=np.array([0.25, 0.0, 0.0]), time_s=0.4)
    assert set(freed(state)) == {6, 7, 8}


def test_what_lies_off_the_grid_counts_as_in_its_outermost_cells():
    layers, state = on_the_maps_grid(one_occupied(5, 9), plugins=["static_layer", "obstacle_layer"])
    inside, off = np.array([0.0, 0.0, 0.0]), np.array([0.9, 0.0, 0.0])
    scan = Scan(0.0, inside, np.array([0.0]), np.array([0.25], np.float32))
    state = layers.updated(state, scan=scan, pose=inside, time_s=0.0)
    written = state.plugged.copy()
    written[5, 9] = FREE
    # Nav2 writes the outermost column anew, here with the map's cell.
    scan = Scan(0.2, off, np.array([0.0]), np.array([0.25], np.float32))
    again = layers.updated(replace(state, plugged=written), scan=scan, pose=off, time_s=0.2)
    assert again.costmap.grid.costs[5, 9] == LETHAL


def test_a_disabled_layer_writes_nothing():
    costmap = local(
        one_occupied(),
        plugins=["static_layer", "inflation_layer"],
        inflation_layer={"enabled": False},
    )
    assert np.count_nonzero(costmap_after_one_update(costmap).costs) == 1


def keepout(occupancy: np.ndarray) -> FilterMask:
    return FilterMask("keepout", OccupancyMap(occupancy, 0.1, -0.5, -0.5))


def test_a_keepout_among_the_filters_is_not_inflated():
    costmap = local(
        masks=[keepout(one_occupied())],
        plugins=["inflation_layer"],
        filters=["keepout_filter"],
    )
    costs = costmap_after_one_update(costmap).costs
    assert costs[8, 8] == LETHAL
    assert np.count_nonzero(costs) == 1


def test_a_keepout_before_the_inflation_is_inflated():
    costmap = local(
        masks=[keepout(one_occupied(8, 5))],
        plugins=["keepout_filter", "inflation_layer"],
        filters=[],
    )
    np.testing.assert_array_equal(costmap_after_one_update(costmap).costs[8, 5:9], PROFILE)


def test_half_a_keepout_raises_costs_and_lowers_none():
    mask = one_occupied(value=50)
    mask[0, 0] = UNKNOWN
    mask[5, 9] = 50
    costmap = local(
        one_occupied(5, 9),
        masks=[keepout(mask)],
        plugins=["static_layer"],
        filters=["keepout_filter"],
    )
    costs = costmap_after_one_update(costmap).costs
    # round(254 * 50 / 100) = 127.
    assert costs[8, 8] == 127
    assert costs[5, 9] == LETHAL
    assert costs[0, 0] == FREE


def test_a_robot_inside_a_keepout_may_drive_out_where_that_is_allowed():
    mask = np.full((10, 10), OCCUPIED, dtype=np.int8)
    parameters = {"override_lethal_cost": True, "lethal_override_cost": 200}
    costmap = local(masks=[keepout(mask)], plugins=[], keepout_filter=parameters)
    assert (costmap_after_one_update(costmap).costs == 200).all()
    mask[4:7, 4:7] = 0
    costmap = local(masks=[keepout(mask)], plugins=[], keepout_filter=parameters)
    costs = costmap_after_one_update(costmap).costs
    assert costs[0, 0] == LETHAL
    assert costs[5, 5] == FREE


def global_layers(occupancy: np.ndarray, **settings) -> LayeredCostmap:
    grid = OccupancyMap(occupancy, 0.1, -2.0, -2.0)
    return LayeredCostmap(
        GlobalCostmapSettings(
            **{"inflation_layer": {"inflation_radius": 0.3, "cost_scaling_factor": 10.0}} | settings
        ),
        GridGeometry.of_map(grid),
        lidar=LidarSettings(),
        footprint=FOOTPRINT,
        static_map=grid,
    )


def global_costmap(layers: LayeredCostmap) -> GlobalCostmap:
    return GlobalCostmap(layers, pose=np.zeros(3), period_s=1.0, offset_s=0.01)


ROOM = np.zeros((40, 40), dtype=np.int8)
ROOM[0], ROOM[-1], ROOM[:, 0], ROOM[:, -1] = (OCCUPIED,) * 4


def test_before_the_first_scan_the_global_costmap_shows_the_map():
    costmap = Rig(global_costmap(global_layers(ROOM)), EMPTY).after(0.005)
    np.testing.assert_array_equal(costmap.costs[20, :4], PROFILE)
    assert costmap.costs[20, 20] == FREE


def test_lyricals_legacy_inflation_does_not_round_distances_as_its_inflation_does():
    map_ = np.zeros((40, 40), dtype=np.int8)
    map_[20, 20] = OCCUPIED
    slope = {"inflation_radius": 0.5, "cost_scaling_factor": 10.0}

    def cost(**plugin):
        layers = global_layers(map_, inflation_layer=slope | plugin)
        return Rig(global_costmap(layers), EMPTY).after(0.005).costs[21, 22]

    # sqrt(5) = 2.23607 cells, in the newer layer 2.24; the robot's inscribed radius is 0.1 m.
    assert cost() == int(252 * np.exp(-10.0 * (0.224 - 0.1))) == 72
    legacy = cost(plugin="nav2_costmap_2d::LegacyInflationLayer")
    assert legacy == int(252 * np.exp(-10.0 * (0.1 * np.sqrt(5.0) - 0.1))) == 73


def test_a_custom_inscribed_radius_takes_the_place_of_the_outlines_since_lyrical():
    map_ = np.zeros((40, 40), dtype=np.int8)
    map_[20, 20] = OCCUPIED
    slope = {"inflation_radius": 0.5, "cost_scaling_factor": 10.0}

    def costs(**plugin):
        layers = global_layers(map_, inflation_layer=slope | plugin)
        return Rig(global_costmap(layers), EMPTY).after(0.005).costs[20, 20:24].tolist()

    # The outline's inscribed radius is 0.1 m: one cell.
    own = [254, 253, int(252 * np.exp(-1.0)), int(252 * np.exp(-2.0))]
    assert costs() == costs(custom_inscribed_radius=-1.0) == own
    assert costs(custom_inscribed_radius=0.2) == [254, 253, 253, int(252 * np.exp(-1.0))]
    legacy = {"plugin": "nav2_costmap_2d::LegacyInflationLayer", "custom_inscribed_radius": 0.2}
    assert costs(**legacy)[1:3] == own[1:3]


def test_the_global_costmap_stays_where_it_is_and_takes_in_what_is_seen():
    costmap = costmap_after_one_update(global_costmap(global_layers(ROOM)), WALL, pose=(0.3, 0, 0))
    assert (costmap.origin_x, costmap.origin_y) == (-2.0, -2.0)
    # The wall's face at x = 0.75 lies in column 27: (0.75 + 2.0) / 0.1 = 27.5.
    np.testing.assert_array_equal(costmap.costs[20, 27:23:-1], PROFILE)
    np.testing.assert_array_equal(costmap.costs[20, :4], PROFILE)


def test_updating_the_touched_window_gives_what_making_all_anew_gives():
    layers = global_layers(ROOM, plugins=["static_layer", "obstacle_layer", "inflation_layer"])
    lidar = Lidar(Timeline.constant(LidarSettings()), WALL)

    def scan_at(pose):
        context = lidar.CreateDefaultContext()
        lidar.GetInputPort("state").FixValue(context, [*pose, 0.0, 0.0, 0.0])
        simulator = Simulator(lidar, context)
        simulator.Initialize()
        simulator.AdvancePendingEvents()
        return lidar.GetOutputPort("scan").Eval(simulator.get_context())

    state = layers.updated(layers.initial_state(), scan=None, pose=np.zeros(3), time_s=0.0)
    for x in (0.0, -0.4, 0.4):
        pose = np.array([x, 0.5 * x, 0.3])
        scan = scan_at(pose)
        state = layers.updated(state, scan=scan, pose=pose, time_s=0.0)
    anew = layers.updated(
        replace(
            layers.initial_state(),
            layers=layers.initial_state().layers
            | {"obstacle_layer": state.layers["obstacle_layer"]},
        ),
        scan=scan,
        pose=pose,
        time_s=0.0,
    )
    np.testing.assert_array_equal(state.costmap.costs, anew.costmap.costs)
    assert np.count_nonzero(state.costmap.costs == LETHAL) > np.count_nonzero(ROOM)


def test_a_request_to_clear_forgets_what_was_seen_and_keeps_the_map():
    rig = Rig(global_costmap(global_layers(ROOM)), WALL)
    assert rig.after(0.05).costs[20, 27] == LETHAL
    # Nothing behind it returns a beam, so the mark stays although the wall has gone.
    rig.change_world(EMPTY)
    assert rig.after(1.05).costs[20, 27] == LETHAL
    rig.request.GetMutableData().set_value(ClearRequest(1.1))
    cleared = rig.after(2.05)
    assert cleared.costs[20, 27] == FREE
    np.testing.assert_array_equal(cleared.costs[20, :4], PROFILE)


def test_one_request_clears_once():
    rig = Rig(global_costmap(global_layers(ROOM)), EMPTY)
    rig.request.GetMutableData().set_value(ClearRequest(0.0))
    rig.after(0.05)
    rig.change_world(WALL)
    assert rig.after(1.05).costs[20, 27] == LETHAL
    rig.change_world(EMPTY)
    assert rig.after(2.05).costs[20, 27] == LETHAL
