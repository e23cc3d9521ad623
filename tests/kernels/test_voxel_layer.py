"""Voxels that points mark and rays clear, by hand-computed columns."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from voxel_cases import COLUMNS as CASE_COLUMNS
from voxel_cases import FIRST_ORIGIN, FOOTPRINT, RESOLUTION_M, Digest, random_runs
from voxel_cases import ROWS as CASE_ROWS

from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.layer_grid import moved_cells, rolled_origin
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import update_obstacle_layer
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.voxel_layer import (
    UNKNOWN_COLUMN,
    count_bits,
    update_voxel_layer,
    voxel_grid,
)

SMALL_SQUARE = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
ROWS, COLUMNS = 9, 12
ROBOT = np.array([4.5, 4.5, 0.0])
SENSOR = (0.5, 4.5, 0.5)
ROW = 4
HEIGHTS = ("min_obstacle_height", "max_obstacle_height")
LEVELS = ("origin_z", "z_resolution", "z_voxels", "unknown_threshold", "mark_threshold")


def seen(*points, origin=SENSOR, marking=True, clearing=True, ranges=(0.0, 50.0, 0.0, 50.0)):
    """An observation; ranges: obstacle_min, obstacle_max, raytrace_min, raytrace_max."""
    return Observation(
        np.array(origin), np.array(points, dtype=float).reshape(-1, 3), marking, clearing, *ranges
    )


class Layer:
    """A layer of 9 x 12 cells of 1 m with four levels of 1 m, the robot at (4.5, 4.5)."""

    def __init__(self, default_cost=FREE, **parameters) -> None:
        self.costs = np.full((ROWS, COLUMNS), default_cost, np.uint8)
        self.voxels = np.full((ROWS, COLUMNS), UNKNOWN_COLUMN, np.uint32)
        self.bounds = None
        self.levels = {"z_resolution": 1.0, "z_voxels": 4}
        self.rest = {"max_obstacle_height": 10.0, "outline": None}
        self.change(parameters)

    def change(self, parameters):
        for name, value in parameters.items():
            own = self.rest if name in ("outline", *HEIGHTS) else self.levels
            own[name] = value

    def cycle(self, *observations, **changes):
        self.change(changes)
        grid = Grid(self.costs, 0.0, 0.0, 1.0)
        self.bounds = update_voxel_layer(
            voxel_grid(grid, self.voxels, **self.levels), observations, **self.rest
        )
        return self

    def column(self, row, column):
        """Returns the levels of a column, the lowest first: '#' marked, '?' unknown, '.' free."""
        bits = int(self.voxels[row, column])
        return "".join(
            "#" if bits >> (16 + level) & 1 else "?" if bits >> level & 1 else "."
            for level in range(4)
        )

    def lethal(self):
        """Returns the lethal cells as (column, row)."""
        return {(int(c), int(r)) for r, c in np.argwhere(self.costs == LETHAL)}


def test_what_cycles_leave_is_what_they_leave_in_nav2():
    left = Digest()
    for run in random_runs(40):
        shape = (CASE_ROWS, CASE_COLUMNS)
        costs = np.full(shape, run.default_cost, np.uint8)
        voxels, origin = np.full(shape, UNKNOWN_COLUMN, np.uint32), FIRST_ORIGIN
        heights = {name: run.parameters[name] for name in HEIGHTS}
        levels = {name: run.parameters[name] for name in LEVELS}
        for pose, observations in run.cycles:
            before = origin
            if run.rolling_window:
                origin = rolled_origin(before, shape, resolution=RESOLUTION_M, robot_pose=pose)
            places = (before, origin)
            costs = moved_cells(costs, *places, resolution=RESOLUTION_M, default=run.default_cost)
            voxels = moved_cells(voxels, *places, resolution=RESOLUTION_M, default=UNKNOWN_COLUMN)
            is_freed = run.parameters["footprint_clearing_enabled"]
            update_voxel_layer(
                voxel_grid(Grid(costs, *origin, RESOLUTION_M), voxels, **levels),
                observations,
                outline=place_outline(FOOTPRINT, pose) if is_freed else None,
                **heights,
            )
            left.add(costs, voxels, origin)
    assert str(left) == "e13dd7eea416d300b751aadcee57683d44ecc783066bbdce8fdcf598d64de3e1"


@pytest.mark.parametrize(("bits", "count"), [(0, 0), (1, 1), (0b1011, 3), (0xFFFF, 16)])
def test_bits_are_counted(bits, count):
    assert count_bits(bits) == count


# Marking


def test_a_point_marks_the_voxel_that_holds_it():
    layer = Layer().cycle(seen((7.5, 4.5, 2.5), clearing=False))
    assert layer.lethal() == {(7, 4)}
    assert layer.column(4, 7) == "??#?"
    assert layer.column(4, 6) == "????"


def test_points_below_the_grid_mark_its_lowest_level_and_those_above_none():
    points = (7.5, 4.5, -3.0), (8.5, 4.5, 4.0)
    layer = Layer(min_obstacle_height=-9.0).cycle(seen(*points, clearing=False))
    assert layer.lethal() == {(7, 4)}
    assert layer.column(4, 7) == "#???"


def test_points_outside_the_band_of_heights_mark_nothing():
    points = [(c + 0.5, 4.5, z) for c, z in enumerate((0.4, 0.5, 1.5, 1.6))]
    heights = {"min_obstacle_height": 0.5, "max_obstacle_height": 1.5}
    assert Layer(**heights).cycle(seen(*points, clearing=False)).lethal() == {(1, 4), (2, 4)}


def test_marking_keeps_to_its_ranges_in_three_dimensions():
    # From (0.5, 4.5, 0.5): 3 m, just less, 5 m by 3 across and 4 up or along, and 2 m.
    points = (3.5, 4.5, 0.5), (3.4, 4.6, 0.5), (0.5, 7.5, 0.5), (2.5, 4.5, 2.5), (2.5, 5.5, 0.5)
    ranges = (2.5, 3.0, 0.0, 50.0)
    layer = Layer().cycle(seen(*points, clearing=False, ranges=ranges))
    # Of the first and the third the range is exactly 3 m: one too far. The fifth is too near.
    assert layer.lethal() == {(3, 4), (2, 4)}


def test_a_column_needs_more_marks_than_the_threshold():
    layer = Layer(mark_threshold=1)
    assert layer.cycle(seen((7.5, 4.5, 0.5), clearing=False)).lethal() == set()
    assert layer.cycle(seen((7.5, 4.5, 1.5), clearing=False)).lethal() == {(7, 4)}


def test_a_sensor_off_the_grid_still_marks():
    above, aside = (0.5, 4.5, 9.0), (-5.0, 4.5, 0.5)
    for origin in (above, aside):
        layer = Layer().cycle(seen((7.5, 4.5, 0.5), origin=origin))
        assert layer.lethal() == {(7, 4)}
        assert layer.column(4, 6) == "????"


# Clearing


def test_rays_end_two_cells_before_their_point():
    layer = Layer().cycle(seen((7.5, 4.5, 0.5)))
    assert [layer.column(4, c) for c in range(9)] == [
        *[".???"] * 6, "????", "#???", "????",
    ]  # fmt: skip


def test_a_mark_less_than_two_cells_before_a_later_hit_stays():
    layer = Layer().cycle(seen((5.5, 4.5, 0.5), (6.5, 4.5, 0.5), clearing=False))
    assert layer.cycle(seen((7.5, 4.5, 0.5))).lethal() == {(6, 4), (7, 4)}


def test_a_point_nearer_than_two_cells_clears_the_sensors_own_voxel():
    layer = Layer().cycle(seen((2.4, 4.5, 0.5), marking=False))
    assert [layer.column(4, c) for c in range(3)] == [".???", "????", "????"]


def test_a_point_in_the_sensor_itself_clears_its_voxel():
    assert Layer().cycle(seen(SENSOR, marking=False)).column(4, 0) == ".???"


def test_a_column_stays_lethal_while_another_level_is_marked():
    layer = Layer().cycle(seen((3.5, 4.5, 0.5), (3.5, 4.5, 2.5), clearing=False))
    assert layer.cycle(seen((9.5, 4.5, 0.5), marking=False)).lethal() == {(3, 4)}
    assert layer.column(4, 3) == ".?#?"
    high = seen((9.5, 4.5, 2.5), origin=(0.5, 4.5, 2.5), marking=False)
    assert layer.cycle(high).lethal() == set()


def test_a_column_with_no_more_marks_than_the_threshold_is_freed():
    layer = Layer(mark_threshold=1)
    layer.cycle(seen(*[(3.5, 4.5, z) for z in (0.5, 1.5, 2.5)], clearing=False))
    assert layer.cycle(seen((9.5, 4.5, 0.5), marking=False)).lethal() == {(3, 4)}
    high = seen((9.5, 4.5, 2.5), origin=(0.5, 4.5, 2.5), marking=False)
    assert layer.cycle(high).lethal() == set()
    assert layer.column(4, 3) == ".#.?"


def test_a_rising_ray_clears_the_voxels_on_its_way():
    # From level 0 to level 3 over seven columns: a level more every 7 / 3 columns.
    ray = seen((9.5, 4.5, 4.6), origin=(0.5, 4.5, 0.5), marking=False)
    layer = Layer().cycle(ray)
    assert [layer.column(4, c) for c in range(8)] == [
        ".???", ".???", "?.??", "?.??", "??.?", "??.?", "???.", "???.",
    ]  # fmt: skip


def test_a_ray_through_the_top_or_the_floor_ends_there():
    for z, level in ((40.5, 3), (-39.5, 0)):
        layer = Layer().cycle(seen((1.5, 4.5, z), origin=(0.5, 4.5, 2.5), marking=False))
        assert layer.column(4, 0)[level] == "."
        assert layer.column(4, 1) == "????"


def test_a_ray_that_leaves_the_grid_clears_up_to_its_edge():
    for end, cell in (((30.5, 4.5, 0.5), (4, 11)), ((4.5, -20.0, 0.5), (0, 4))):
        origin = (4.5, 4.5, 0.5)
        assert Layer().cycle(seen(end, origin=origin, marking=False)).column(*cell) == ".???"


def test_clearing_keeps_to_its_ranges():
    layer = Layer().cycle(seen((9.5, 4.5, 0.5), marking=False, ranges=(0.0, 50.0, 2.0, 4.0)))
    # Starts at column 2; four sevenths of the five columns from there to 7 are two.
    cleared = [c for c in range(12) if layer.column(4, c) == ".???"]
    assert cleared == [2, 3, 4]


@pytest.mark.parametrize("origin", [(0.5, 4.5, 4.5), (0.5, 4.5, -0.5), (-0.5, 4.5, 0.5)])
def test_a_sensor_off_the_grid_clears_nothing(origin):
    layer = Layer().cycle(seen((9.5, 4.5, 0.5), origin=origin, marking=False))
    np.testing.assert_array_equal(layer.voxels, UNKNOWN_COLUMN)


def test_columns_with_too_many_unknown_voxels_become_unknown():
    ray = seen((9.5, 4.5, 0.5), marking=False)
    # Three of four levels stay unknown.
    assert Layer(unknown_threshold=3).cycle(ray).costs[4, 3] == FREE
    assert Layer(unknown_threshold=2).cycle(ray).costs[4, 3] == NO_INFORMATION


def test_a_ray_turns_unknown_cells_free():
    layer = Layer(NO_INFORMATION).cycle(seen((9.5, 4.5, 0.5)))
    expected = np.full(COLUMNS, NO_INFORMATION)
    expected[:8], expected[9] = FREE, LETHAL
    np.testing.assert_array_equal(layer.costs[4], expected)


# A whole cycle


def test_all_rays_clear_before_any_point_marks():
    near, far = seen((3.5, 4.5, 0.5)), seen((9.5, 4.5, 0.5))
    for order in ((near, far), (far, near)):
        assert Layer().cycle(*order).lethal() == {(3, 4), (9, 4)}


def test_each_source_has_its_own_part():
    scan = seen((9.5, 4.5, 0.5), marking=False)
    camera = seen((3.5, 4.5, 0.5), (11.5, 4.5, 0.5), clearing=False, ranges=(0.0, 5.0, 0.0, 50.0))
    layer = Layer().cycle(camera)
    assert layer.lethal() == {(3, 4)}
    assert layer.cycle(scan).lethal() == set()


def test_footprint_frees_costs_and_leaves_voxels():
    layer = Layer(outline=place_outline(SMALL_SQUARE, ROBOT))
    layer.cycle(seen((4.5, 4.5, 1.5), clearing=False))
    assert layer.lethal() == set()
    assert layer.column(4, 4) == "?#??"
    # A ray through another level does not bring the mark back, a further point there does.
    other = seen((9.5, 4.5, 0.5), marking=False)
    away = {"outline": place_outline(SMALL_SQUARE, np.array([8.5, 1.5, 0.0]))}
    assert layer.cycle(other, **away).lethal() == set()
    assert layer.cycle(seen((4.5, 4.5, 2.5), clearing=False), **away).lethal() == {(4, 4)}


def test_bounds_hold_ray_ends_marks_and_footprint_but_not_the_sensor():
    layer = Layer(outline=place_outline(SMALL_SQUARE, ROBOT))
    layer.cycle(seen((9.5, 4.5, 0.5), ranges=(0.0, 50.0, 0.0, 4.0)))
    np.testing.assert_allclose(layer.bounds, [4.3, 4.3, 9.5, 4.7])
    assert not np.isfinite(Layer().cycle().bounds).any()


@settings(max_examples=40)
@given(
    centimetres=st.lists(st.integers(20, 600), min_size=60, max_size=60),
    yaw=st.floats(-3.0, 3.0),
    height=st.floats(0.0, 1.9),
)
def test_standing_in_a_still_world_it_is_the_obstacle_layer(centimetres, yaw, height):
    shape, origin, resolution = (50, 50), (-2.5, -2.5), 0.1
    pose = np.array([0.03, 0.04, yaw])
    angles = np.linspace(-3.0, 3.0, 60)
    # At exactly obstacle_max_range a point marks in the obstacle layer only.
    ranges = 0.01 * np.array(centimetres) + 0.0037
    points = np.column_stack(
        [
            pose[0] + ranges * np.cos(yaw + angles),
            pose[1] + ranges * np.sin(yaw + angles),
            np.full(60, height),
        ]
    )
    scan = seen(*points, origin=(*pose[:2], height), ranges=(0.0, 2.5, 0.0, 3.0))
    outline = place_outline(SMALL_SQUARE, pose)
    flat, costs = (Grid(np.zeros(shape, np.uint8), *origin, resolution) for _ in range(2))
    voxels = voxel_grid(costs, np.full(shape, UNKNOWN_COLUMN, np.uint32))
    for _ in range(3):
        update_obstacle_layer(flat, [scan], outline=outline)
        update_voxel_layer(voxels, [scan], outline=outline)
        np.testing.assert_array_equal(costs.costs, flat.costs)
