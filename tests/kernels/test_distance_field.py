import numpy as np
import pytest
from scenes import WHEELCHAIR

from drake_navbench.controllers.teb.footprint_model import footprint_discs
from drake_navbench.kernels.distance_field import distance_field, path_clearance, sample_distance
from drake_navbench.kernels.grid import FREE, LETHAL, Costmap

CELL = 0.05


def costmap_with(cells, shape=(40, 40), origin=(0.0, 0.0)):
    costs = np.full(shape, FREE, dtype=np.uint8)
    for row, column in cells:
        costs[row, column] = LETHAL
    return Costmap(costs, *origin, CELL)


def wall():
    """A wall on columns 30 and up of a 2 x 2 m map: its face is at x = 1.5 m."""
    return distance_field(costmap_with([(r, c) for r in range(40) for c in range(30, 40)]))


SCATTERED = [tuple(cell) for cell in np.random.default_rng(3).integers(0, 40, (60, 2))]
BLOCK_IN_THE_CORNER = [(row, column) for row in range(31, 40) for column in range(12)]


@pytest.mark.parametrize("cells", [SCATTERED, BLOCK_IN_THE_CORNER])
def test_field_agrees_with_brute_force(cells):
    field = distance_field(costmap_with(cells))
    rows, columns = np.mgrid[0:40, 0:40]
    lethal = np.zeros((40, 40), dtype=bool)
    lethal[tuple(np.array(cells).T)] = True
    for source, sign in ((lethal, 1.0), (~lethal, -1.0)):
        sources = np.argwhere(source)
        squared = (rows[..., None] - sources[:, 0]) ** 2 + (columns[..., None] - sources[:, 1]) ** 2
        expected = sign * (np.sqrt(squared.min(axis=2)) - 0.5) * CELL
        np.testing.assert_allclose(field.distances[~source], expected[~source], atol=1e-12)


@pytest.mark.parametrize(("x", "distance"), [(0.5, 1.0), (1.233, 0.267), (1.5, 0.0), (1.6, -0.1)])
def test_distance_to_a_straight_wall_is_exact(x, distance):
    value, slope_x, slope_y = sample_distance(wall(), x, 0.987)
    assert value == pytest.approx(distance, abs=1e-12)
    assert (slope_x, slope_y) == pytest.approx((-1.0, 0.0), abs=1e-12)


def test_slopes_agree_with_finite_differences_and_do_not_jump():
    rng = np.random.default_rng(5)
    field = distance_field(costmap_with([tuple(c) for c in rng.integers(0, 40, (15, 2))]))
    step = 1e-7
    for x, y in rng.uniform(-0.1, 2.1, (200, 2)):
        _, slope_x, slope_y = sample_distance(field, x, y)
        numeric_x = sample_distance(field, x + step, y)[0] - sample_distance(field, x - step, y)[0]
        numeric_y = sample_distance(field, x, y + step)[0] - sample_distance(field, x, y - step)[0]
        assert slope_x == pytest.approx(numeric_x / (2 * step), abs=1e-5)
        assert slope_y == pytest.approx(numeric_y / (2 * step), abs=1e-5)


def test_beyond_the_map_the_nearest_value_holds_and_the_slope_across_is_zero():
    border = wall().distances[20, 0]
    assert sample_distance(wall(), -4.0, 1.0) == pytest.approx((border, 0.0, 0.0), abs=1e-12)


def test_slopes_do_not_jump_on_the_way_off_the_map():
    field = distance_field(costmap_with(SCATTERED[:9]))
    ways = np.linspace(-0.2, 2.2, 2401)
    for along in (0.3, 1.1, 1.7):
        for points in ([(x, along) for x in ways], [(along, y) for y in ways]):
            slopes = np.array([sample_distance(field, x, y)[1:] for x, y in points])
            # A millimetre is a fiftieth of a cell, over which no slope changes by more than 2.
            assert np.abs(np.diff(slopes, axis=0)).max() < 0.1


def test_a_map_without_obstacles_is_clear_by_its_diagonal():
    field = distance_field(costmap_with([]))
    np.testing.assert_allclose(field.distances, (np.hypot(40, 40) - 0.5) * CELL)


def test_clearance_of_a_pose_is_that_of_its_nearest_disc():
    # Facing the wall at x = 1.5 from x = 0.5: front disc at 1.05, 1.5 - 1.05 - 0.3 = 0.15 m;
    # facing away: the rear disc at 0.45, 1.5 - 0.45 - 0.3 = 0.75 m.
    discs = footprint_discs(WHEELCHAIR)
    poses = np.array([[0.5, 1.0, 0.0], [0.5, 1.0, np.pi]])
    np.testing.assert_allclose(path_clearance(wall(), discs, poses), [0.15, 0.75], atol=1e-12)
