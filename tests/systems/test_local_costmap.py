"""The local costmap marks what the lidar sees and forgets what has gone."""

import numpy as np
import pytest
from costmap_rig import Rig

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.world import Box, World
from drake_navbench.kernels.grid import FREE, INSCRIBED, LETHAL
from drake_navbench.navigation.costmaps.costmap_settings import LocalCostmapSettings
from drake_navbench.trial.systems.local_costmap import LocalCostmap

FOOTPRINT = np.array([[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]])
BACKDROP = Box(type="box", min=(2.5, -3.0), max=(2.6, 3.0))
PARCEL = Box(type="box", min=(1.5, -0.2), max=(1.7, 0.2))
SCAN = {
    "clearing": True,
    "max_obstacle_height": 2.0,
    "obstacle_max_range": 2.95,
    "raytrace_max_range": 3.0,
}
SETTINGS = LocalCostmapSettings(
    width=6,
    height=6,
    resolution=0.05,
    obstacle_layer={"observation_sources": {"scan": SCAN}},
    inflation_layer={"inflation_radius": 0.6, "cost_scaling_factor": 3.0},
)


def rig_in(world: World) -> Rig:
    """A robot at the origin of a world."""
    costmap = LocalCostmap(SETTINGS, LidarSettings(), footprint=FOOTPRINT, offset_s=0.01)
    return Rig(costmap, world)


def cost_at(costmap, x: float, y: float) -> int:
    column = int((x - costmap.origin_x) / costmap.resolution)
    row = int((y - costmap.origin_y) / costmap.resolution)
    return int(costmap.costs[row, column])


def test_there_is_no_costmap_before_the_first_update():
    assert rig_in(World((PARCEL,))).after(0.005) is None


def test_the_face_that_the_lidar_sees_is_lethal_and_what_lies_behind_it_is_not():
    costmap = rig_in(World((PARCEL,))).after(0.1)
    assert cost_at(costmap, 1.525, 0.0) == LETHAL
    assert cost_at(costmap, 1.475, 0.025) == INSCRIBED
    assert cost_at(costmap, 1.675, 0.0) < LETHAL


def test_far_from_everything_the_costmap_is_free():
    costmap = rig_in(World((PARCEL,))).after(0.1)
    assert cost_at(costmap, -2.0, -2.0) == FREE


def test_what_is_beyond_the_marking_range_is_not_marked():
    far = World((Box(type="box", min=(2.96, -0.5), max=(3.0, 0.5)),))
    assert not np.any(rig_in(far).after(0.1).costs)


def test_the_costmap_clears_when_a_thing_goes_away():
    rig = rig_in(World((PARCEL, BACKDROP)))
    assert cost_at(rig.after(0.1), 1.525, 0.0) == LETHAL
    rig.change_world(World((BACKDROP,)))
    # The next scan comes at 0.1 s, the next update at 0.21 s.
    costmap = rig.after(0.3)
    assert cost_at(costmap, 1.525, 0.0) == FREE
    assert cost_at(costmap, 2.525, 0.0) == LETHAL


def test_without_anything_behind_it_a_thing_that_went_away_stays_as_in_nav2():
    rig = rig_in(World((PARCEL,)))
    rig.after(0.1)
    rig.change_world(World(()))
    assert cost_at(rig.after(0.3), 1.525, 0.0) == LETHAL


def test_the_window_rolls_with_the_robot_and_keeps_what_it_holds():
    rig = rig_in(World((PARCEL,)))
    before = rig.after(0.1)
    rig.move_to((0.5, 0.0, 0.0))
    after = rig.after(0.3)
    assert after.origin_x - before.origin_x == pytest.approx(0.5, abs=0.05)
    shift_in_cells = (after.origin_x - before.origin_x) / 0.05
    assert shift_in_cells == pytest.approx(round(shift_in_cells), abs=1e-6)
    assert cost_at(after, 1.525, 0.0) == LETHAL


def test_the_world_turned_by_a_right_angle_gives_the_turned_costmap():
    east = rig_in(World((PARCEL,))).after(0.1)
    north = rig_in(World((Box(type="box", min=(-0.2, 1.5), max=(0.2, 1.7)),))).after(0.1)
    turned = np.rot90(east.costs, k=-1)  # rows are y, so the picture is upside down
    different = np.count_nonzero(north.costs != turned)
    # Beams that graze a corner may fall into either of two cells.
    assert different < 0.002 * turned.size
