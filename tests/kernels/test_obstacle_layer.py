"""The obstacle layer rolls, clears and marks as Nav2's does."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.kernels.grid import FREE, LETHAL, NO_INFORMATION, Grid
from drake_navbench.kernels.observation import Observation
from drake_navbench.kernels.obstacle_layer import (
    IN_CELLS,
    IN_PLANE,
    IN_SPACE,
    clear_rays,
    mark_points,
    points_between,
    scan_points,
    update_obstacle_layer,
)
from drake_navbench.kernels.poses import place_outline
from drake_navbench.navigation.costmaps.observation_source import ObservationSourceSettings

L, U = LETHAL, NO_INFORMATION
SMALL_SQUARE = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])


def empty_bounds():
    return np.array([np.inf, np.inf, -np.inf, -np.inf])


def on_the_floor(sensor, points):
    """A sensor (3,) and points (N, 3) at height 0, of which x and y are given."""
    flat = np.array(points, dtype=float).reshape(-1, 2)
    return np.array([*sensor, 0.0]), np.column_stack([flat, np.zeros(len(flat))])


def cleared(sensor, points, *, shape=(10, 10), minimum=0.0, maximum=100.0, resolution=1.0):
    """Cells that rays from a sensor clear, on a grid with its corner at (0, 0)."""
    costs = np.full(shape, LETHAL, dtype=np.uint8)
    clear_rays(
        Grid(costs, 0.0, 0.0, resolution),
        empty_bounds(),
        *on_the_floor(sensor, points),
        (minimum, maximum),
    )
    return {(int(x), int(y)) for y, x in np.argwhere(costs == FREE)}


def marked(sensor, points, *, minimum=0.0, maximum=100.0, resolution=1.0):
    costs = np.zeros((10, 10), dtype=np.uint8)
    mark_points(
        Grid(costs, 0.0, 0.0, resolution),
        empty_bounds(),
        *on_the_floor(sensor, points),
        (minimum, maximum),
        (0.0, 2.0),
    )
    assert set(np.unique(costs)) <= {FREE, LETHAL}
    return {(int(x), int(y)) for y, x in np.argwhere(costs == LETHAL)}


@pytest.mark.parametrize(
    ("point", "marking"),
    [
        # 5.4 m, but 5 cells; exactly 5 m; 4.8 m along the floor, but 5.2 m in space; 4 m.
        ((5.9, 0.5, 0.0), {IN_CELLS}),
        ((5.5, 0.5, 0.0), {IN_CELLS, IN_PLANE}),
        ((5.3, 0.5, 2.0), {IN_CELLS, IN_PLANE}),
        ((4.5, 0.5, 0.0), {IN_CELLS, IN_PLANE, IN_SPACE}),
    ],
)
def test_the_range_of_marking_is_measured_as_in_each_release(point, marking):
    def is_marked(measured):
        costs = np.zeros((10, 10), dtype=np.uint8)
        seen = np.array([0.5, 0.5, 0.0]), np.array([point])
        grid = Grid(costs, 0.0, 0.0, 1.0)
        mark_points(grid, empty_bounds(), *seen, (0.0, 5.0), (0.0, 2.0), measured)
        return bool(costs.any())

    assert {kind for kind in (IN_PLANE, IN_CELLS, IN_SPACE) if is_marked(kind)} == marking


# Scan to points


def hits(pose, angles, ranges, *, height=0.0, inf_is_valid=False):
    """What a scanner with a range from 0.1 to 10 m sees."""
    return scan_points(
        pose,
        np.array(angles),
        np.array(ranges),
        height=height,
        range_min=0.1,
        range_max=10.0,
        inf_is_valid=inf_is_valid,
    )


def test_beam_gives_a_point_from_the_sensor_along_its_heading():
    pose = np.array([1.0, 2.0, math.pi / 2])
    points = hits(pose, [0.0, -math.pi / 2], [3.0, 0.5], height=0.4)
    np.testing.assert_allclose(points, [[1.0, 5.0, 0.4], [1.5, 2.0, 0.4]], atol=1e-12)


def test_beams_out_of_range_give_no_point():
    ranges = [0.1, 0.0999, 10.0, 9.999, np.inf, -np.inf, np.nan]
    points = hits(np.zeros(3), np.zeros(7), ranges)
    np.testing.assert_array_equal(points[:, 0], [0.1, 9.999])


def test_beam_without_return_reaches_the_range_where_inf_is_valid():
    ranges = [np.inf, -np.inf, np.nan]
    points = hits(np.zeros(3), np.zeros(3), ranges, inf_is_valid=True)
    np.testing.assert_allclose(points, [[9.9999, 0.0, 0.0]])


def test_points_at_both_heights_are_between_them():
    points = np.column_stack([np.arange(5.0), np.zeros(5), [0.09, 0.1, 0.5, 1.0, 1.1]])
    assert points_between(points, 0.1, 1.0)[:, 0].tolist() == [1.0, 2.0, 3.0]


# Clearing


def test_ray_clears_from_the_sensor_to_the_hit_both_included():
    assert cleared((1.5, 2.5), [[4.9, 2.1]]) == {(1, 2), (2, 2), (3, 2), (4, 2)}


def test_ray_takes_minor_steps_as_the_error_says():
    # 5 columns, 2 rows: the error starts at 5 // 2 = 2 and grows by 2:
    # 4, 6 -> step, 1, 3, 5 -> step.
    expected = {(0, 0), (1, 0), (2, 1), (3, 1), (4, 2), (5, 2)}
    assert cleared((0.5, 0.5), [[5.5, 2.5]]) == expected
    assert cleared((0.5, 0.5), [[2.5, 5.5]]) == {(y, x) for x, y in expected}


def test_ray_backwards_may_take_other_cells_than_forwards():
    # 4 columns, 2 rows: the error starts at 2: 4 -> step, 2, 4 -> step, 2.
    forwards = {(0, 0), (1, 1), (2, 1), (3, 2), (4, 2)}
    assert cleared((0.5, 0.5), [[4.5, 2.5]]) == forwards
    assert cleared((4.5, 2.5), [[0.5, 0.5]]) == {(4, 2), (3, 1), (2, 1), (1, 0), (0, 0)}


def test_ray_into_its_own_cell_clears_that_cell():
    assert cleared((3.2, 3.2), [[3.8, 3.8]]) == {(3, 3)}


def test_clearing_ends_at_raytrace_max_range():
    # 8 cells, at most 3.2 / 1 rounded up = 4: int(4 / 8 * 8) = 4 steps after the first cell.
    assert cleared((0.5, 0.5), [[8.5, 0.5]], maximum=3.2) == {(x, 0) for x in range(5)}


def test_clearing_starts_at_raytrace_min_range():
    # The first cell is int(0 + 8 / 8 * 3) = 3; from there the whole rest.
    assert cleared((0.5, 0.5), [[8.5, 0.5]], minimum=2.5) == {(x, 0) for x in range(3, 9)}


def test_ranges_shorten_the_rest_of_a_ray_in_proportion():
    # From cell 2, 6 of 8 cells are left; a limit of 4 of those 8 gives int(4 / 8 * 6) = 3 steps,
    # to cell 5: one beyond the range, as in Nav2.
    found = cleared((0.5, 0.5), [[8.5, 0.5]], minimum=2.0, maximum=4.0)
    assert found == {(x, 0) for x in range(2, 6)}


def test_hit_nearer_than_raytrace_min_range_clears_nothing():
    assert cleared((0.5, 0.5), [[2.5, 0.5]], minimum=3.0) == set()


def test_ray_beyond_the_grid_is_cut_at_its_edges():
    right = cleared((8.5, 5.5), [[20.5, 5.5]])
    assert right == {(8, 5), (9, 5)}
    assert cleared((1.5, 5.5), [[-20.5, 5.5]]) == {(1, 5), (0, 5)}
    assert cleared((5.5, 8.5), [[5.5, 20.5]]) == {(5, 8), (5, 9)}
    assert cleared((5.5, 1.5), [[5.5, -20.5]]) == {(5, 1), (5, 0)}
    # Near the diagonal both edges cut.
    assert cleared((7.5, 7.5), [[17.5, 17.6]]) == {(7, 7), (8, 8), (9, 9)}
    assert cleared((2.5, 2.5), [[-9.5, -9.6]]) == {(2, 2), (1, 1), (0, 0)}


def test_ray_right_through_the_upper_corner_clears_nothing_as_in_nav2():
    # Cut at x = 10 it ends at y = 10 exactly: not above the edge, so not cut, yet off the grid.
    assert cleared((7.5, 7.5), [[17.5, 17.5]]) == set()
    assert cleared((2.5, 2.5), [[-9.5, -9.5]]) == {(2, 2), (1, 1), (0, 0)}


def test_sensor_outside_the_grid_clears_and_marks_nothing():
    assert cleared((-0.5, 5.5), [[5.5, 5.5]]) == set()
    assert marked((-0.5, 5.5), [[5.5, 5.5]]) == set()


# Marking


def test_hits_mark_their_cells():
    assert marked((0.5, 0.5), [[3.2, 4.9], [0.1, 0.1]]) == {(3, 4), (0, 0)}


def test_hits_off_the_grid_mark_nothing():
    assert marked((0.5, 0.5), [[10.0, 5.0], [5.0, -0.1]]) == set()


def test_marking_keeps_to_its_annulus_in_metres():
    points = [[1.9, 0.5], [2.5, 0.5], [4.5, 0.5], [4.6, 0.5]]
    assert marked((0.5, 0.5), points, minimum=2.0, maximum=4.0) == {(2, 0), (4, 0)}


def test_marking_keeps_to_its_annulus_in_cells_too():
    # 1.6 m is 2 cells, rounded up. From x = 0.9 to 2.6 are 2 cells; from 0.3 to 1.95 only 1: too
    # close in cells, although 1.65 m.
    assert marked((0.9, 0.5), [[2.6, 0.5]], minimum=1.6) == {(2, 0)}
    assert marked((0.3, 0.5), [[1.95, 0.5]], minimum=1.6) == set()


def test_a_negative_least_range_counts_as_its_square_as_in_nav2():
    ObservationSourceSettings(obstacle_min_range=-2.0, raytrace_min_range=-0.2)
    assert marked((5.5, 5.5), [(7.0, 5.5), (8.0, 5.5)], minimum=-2.0) == {(8, 5)}
    assert cleared((0.5, 0.5), [(2.5, 0.5)], minimum=-0.2) == {(0, 0), (1, 0), (2, 0)}


def test_marking_leaves_other_marks():
    costs = np.zeros((10, 10), dtype=np.uint8)
    costs[7, 7] = LETHAL
    seen = on_the_floor((0.5, 0.5), [[3.5, 0.5]])
    mark_points(Grid(costs, 0.0, 0.0, 1.0), empty_bounds(), *seen, (0.0, 9.0), (0.0, 2.0))
    assert costs[7, 7] == costs[0, 3] == LETHAL


# A whole cycle


ROBOT = np.array([4.5, 4.5, 0.0])


def scan(ranges, *, pose=ROBOT, angles=(0.0, 0.5 * math.pi), inf_is_valid=False, **limits):
    """What a scanner sees whose beams look ahead and to its left; ranges up to 10 m count."""
    points = scan_points(
        np.array(pose),
        np.array(angles),
        np.array(ranges),
        height=0.5,
        range_min=0.1,
        range_max=20.0,
        inf_is_valid=inf_is_valid,
    )
    counted = {"obstacle_min_range": 0.0, "obstacle_max_range": 10.0}
    counted |= {"raytrace_min_range": 0.0, "raytrace_max_range": 10.0}
    return Observation(
        origin=np.array([pose[0], pose[1], 0.5]),
        points=points,
        marking=True,
        clearing=True,
        **counted | limits,
    )


def cycle(costs, *scans, footprint=SMALL_SQUARE, pose=ROBOT):
    """One cycle of a robot in the middle of a 9 x 9 m grid: the costs after it, and the bounds."""
    after = costs.copy()
    outline = None if footprint is None else place_outline(footprint, pose)
    bounds = update_obstacle_layer(Grid(after, 0.0, 0.0, 1.0), scans, outline=outline)
    return after, bounds


def free_grid():
    return np.zeros((9, 9), dtype=np.uint8)


def test_cycle_marks_hits_and_clears_what_lies_before():
    costs = free_grid()
    costs[4, 6] = costs[6, 4] = costs[1, 1] = LETHAL
    after, _ = cycle(costs, scan([3.0, 4.0]))
    expected = free_grid()
    expected[4, 7] = expected[8, 4] = expected[1, 1] = LETHAL
    np.testing.assert_array_equal(after, expected)


def test_a_second_scanner_marks_and_clears_from_its_own_place():
    # It looks from the middle of the cell at (6, 6) down along y, at right angles to the first.
    second = scan([3.0, np.inf], pose=(6.5, 6.5, -np.pi / 2))
    costs = free_grid()
    costs[4, 6] = LETHAL
    after, _ = cycle(costs, scan([3.0, np.inf]), second)
    expected = free_grid()
    # The first one's ray and the second one's both pass the cell in row 4, column 6.
    expected[4, 7] = expected[3, 6] = LETHAL
    np.testing.assert_array_equal(after, expected)


def test_no_scanner_clears_what_another_one_has_just_marked():
    # The second one's ray passes the very cell in which the first one's ends.
    second = scan([6.0, np.inf], pose=(7.5, 7.5, -np.pi / 2))
    after, _ = cycle(free_grid(), scan([3.0, np.inf]), second)
    assert after[4, 7] == LETHAL
    assert after[1, 7] == LETHAL


def test_removed_obstacle_stays_where_no_ray_passes():
    seen, _ = cycle(free_grid(), scan([3.0, np.inf]))
    assert seen[4, 7] == LETHAL
    assert cycle(seen, scan([np.inf, np.inf]))[0][4, 7] == LETHAL
    assert cycle(seen, scan([np.inf, np.inf], inf_is_valid=True))[0][4, 7] == FREE


def test_all_rays_clear_before_any_hit_marks():
    # The second beam passes through the cell that the first one hits.
    angles = np.array([0.0, 0.01])
    for order in ([0, 1], [1, 0]):
        ranges = np.array([2.0, 4.0])[order]
        assert cycle(free_grid(), scan(ranges, angles=angles[order]))[0][4, 6] == LETHAL


def test_ray_turns_unknown_cells_free():
    unknown = np.full((9, 9), NO_INFORMATION, dtype=np.uint8)
    after, _ = cycle(unknown, scan([3.0, np.inf]))
    np.testing.assert_array_equal(after[4, 3:], [U, FREE, FREE, FREE, L, U])


def test_points_outside_of_the_heights_clear_but_do_not_mark():
    costs = free_grid()
    costs[4, 6] = LETHAL
    seen = scan([3.0, np.inf])
    for low, high, mark in ((0.5, 0.5, LETHAL), (0.51, 2.0, FREE), (0.0, 0.49, FREE)):
        after = costs.copy()
        update_obstacle_layer(
            Grid(after, 0.0, 0.0, 1.0),
            [seen],
            outline=None,
            min_obstacle_height=low,
            max_obstacle_height=high,
        )
        assert (after[4, 6], after[4, 7]) == (FREE, mark)


def test_footprint_is_freed_last():
    wide = np.array([[1.2, 1.2], [-1.2, 1.2], [-1.2, -1.2], [1.2, -1.2]])
    hit_inside = scan([1.0, np.inf])
    assert not cycle(free_grid(), hit_inside, footprint=wide)[0].any()
    assert cycle(free_grid(), hit_inside, footprint=None)[0][4, 5] == LETHAL


def test_bounds_hold_sensor_ray_ends_hits_and_footprint():
    seen = scan([3.0, 4.0], raytrace_max_range=2.0, obstacle_max_range=3.5)
    # The ray upwards ends after 2 m and its hit, 4 m away, does not mark; the hit ahead does.
    np.testing.assert_allclose(cycle(free_grid(), seen)[1], [4.3, 4.3, 7.5, 6.5])


@settings(deadline=None)
@given(
    shift_x=st.integers(-50, 50),
    shift_y=st.integers(-50, 50),
    ranges=st.lists(st.floats(0.0, 6.0), min_size=24, max_size=24),
)
def test_world_moved_by_whole_cells_gives_the_same_grid(shift_x, shift_y, ranges):
    # An eighth of a metre is exact in binary, so that moving it rounds nothing but the hits.
    resolution = 0.125
    updates = []
    for x, y in ((0.0, 0.0), (shift_x * resolution, shift_y * resolution)):
        pose = np.array([x + 0.0625, y + 0.0625, 0.3])
        grid = Grid(np.zeros((64, 64), dtype=np.uint8), x - 4.0, y - 4.0, resolution)
        seen = scan(
            np.round(np.array(ranges), 3) + 0.0003, pose=pose, angles=np.linspace(-3.0, 3.0, 24)
        )
        bounds = update_obstacle_layer(grid, [seen], outline=place_outline(SMALL_SQUARE, pose))
        updates.append((grid.costs, bounds))
    np.testing.assert_array_equal(updates[0][0], updates[1][0])
    moved = np.tile([shift_x, shift_y], 2) * resolution
    np.testing.assert_allclose(updates[1][1] - moved, updates[0][1], atol=1e-12)
