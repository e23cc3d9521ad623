"""A* against brute force, and its tolerance, limits and corner rule."""

import math

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from drake_navbench.kernels.astar import (
    EXPANSION_BUDGET_SPENT,
    FOUND,
    GOAL_OCCUPIED,
    ITERATION_LIMIT,
    OPEN_SET_EMPTY,
    SearchRules,
    search,
    step_costs,
)

NO_LIMIT = 10**12
LETHAL, INSCRIBED, UNKNOWN = 254, 253, 255
STEPS = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)]


def run(costs, start, goal, **options):
    """Searches with Nav2's defaults, but without cutting corners."""
    defaults = {
        "tolerance": 2.5,
        "cost_travel_multiplier": 1.0,
        "allow_unknown": True,
        "corner_cutting": False,
        "max_iterations": 0,
        "max_on_approach_iterations": 1000,
        "terminal_checking_interval": 5000,
        "expansion_budget": NO_LIMIT,
    }
    goal_cell = (int(goal[0]), int(goal[1]))
    rules = SearchRules(**{**defaults, **options})
    return search(np.ascontiguousarray(costs), start, goal_cell, goal, rules)


def is_free(costs, column, row, allow_unknown=True):
    rows, columns = costs.shape
    if not (0 <= column < columns and 0 <= row < rows):
        return False
    cost = costs[row, column]
    return cost < INSCRIBED or (cost == UNKNOWN and allow_unknown)


def edges(costs, multiplier, allow_unknown, corner_cutting):
    """Yields (from, to, cost) of every step of the grid, written down without the kernel."""
    rows, columns = costs.shape
    for row in range(rows):
        for column in range(columns):
            for dx, dy in STEPS:
                if not is_free(costs, column + dx, row + dy, allow_unknown):
                    continue
                beside = is_free(costs, column + dx, row, allow_unknown) and is_free(
                    costs, column, row + dy, allow_unknown
                )
                if dx and dy and not corner_cutting and not beside:
                    continue
                entered = float(costs[row + dy, column + dx])
                cost = math.hypot(dx, dy) * (1.0 + multiplier * entered / 252.0)
                yield row * columns + column, (row + dy) * columns + column + dx, cost


def brute_force(costs, start, multiplier, allow_unknown, corner_cutting):
    """(rows, columns) least cost of every cell from the start, inf where there is none."""
    sources, targets, weights = zip(
        *edges(costs, multiplier, allow_unknown, corner_cutting), strict=True
    )
    graph = coo_matrix((weights, (sources, targets)), shape=(costs.size, costs.size))
    index = start[1] * costs.shape[1] + start[0]
    return dijkstra(graph.tocsr(), indices=index).reshape(costs.shape)


def path_cost(costs, cells, multiplier):
    lengths = np.hypot(*np.diff(cells, axis=0).T)
    entered = costs[cells[1:, 1], cells[1:, 0]].astype(float)
    return float(np.sum(lengths * (1.0 + multiplier * entered / 252.0)))


def wall_map():
    """20 x 20 cells, a wall at column 10 with a gap at row 3."""
    costs = np.zeros((20, 20), dtype=np.uint8)
    costs[:, 10] = LETHAL
    costs[3, 10] = 0
    return costs


@pytest.mark.parametrize("corner_cutting", [True, False])
@pytest.mark.parametrize("allow_unknown", [True, False])
@pytest.mark.parametrize("multiplier", [0.0, 1.0, 3.0])
def test_a_path_costs_what_brute_force_finds(multiplier, allow_unknown, corner_cutting):
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(6):
        costs = rng.integers(0, 253, (25, 31)).astype(np.uint8)
        special = rng.random(costs.shape)
        costs[special < 0.2] = LETHAL
        costs[special > 0.9] = UNKNOWN
        start, goal = (2, 3), (27, 20)
        costs[goal[1], goal[0]] = 0
        least = brute_force(costs, start, multiplier, allow_unknown, corner_cutting)
        status, cells, _ = run(
            costs,
            start,
            goal,
            tolerance=0.0,
            cost_travel_multiplier=multiplier,
            allow_unknown=allow_unknown,
            corner_cutting=corner_cutting,
        )
        expected = least[goal[1], goal[0]]
        assert (status == FOUND) == math.isfinite(expected)
        if status == FOUND:
            found += 1
            assert tuple(cells[0]) == start
            assert tuple(cells[-1]) == goal
            # float32 sums of some 50 steps.
            assert path_cost(costs, cells, multiplier) == pytest.approx(expected, rel=1e-5)
    assert found > 0


@pytest.mark.parametrize("flip", [np.s_[:, ::-1], np.s_[::-1, :], np.s_[::-1, ::-1]])
def test_a_mirrored_world_gives_a_path_of_equal_cost(flip):
    rng = np.random.default_rng(4)
    costs = np.where(rng.random((40, 40)) < 0.2, LETHAL, rng.integers(0, 100, (40, 40)))
    costs = costs.astype(np.uint8)
    costs[5, 5] = costs[30, 33] = 0
    rows = np.arange(1600).reshape(40, 40)[flip]
    place = {int(cell): (i % 40, i // 40) for i, cell in enumerate(rows.ravel())}
    status, cells, _ = run(costs, (5, 5), (33, 30))
    mirrored = np.ascontiguousarray(costs[flip])
    mirror_status, mirror_cells, _ = run(mirrored, place[5 * 40 + 5], place[30 * 40 + 33])
    assert status == mirror_status == FOUND
    assert path_cost(mirrored, mirror_cells, 1.0) == pytest.approx(
        path_cost(costs, cells, 1.0), rel=1e-5
    )


def test_the_unique_shortest_path_through_a_gap_mirrors_cell_by_cell():
    costs = np.full((7, 7), LETHAL, dtype=np.uint8)
    for column, row in [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (3, 2), (4, 2)]:
        costs[row, column] = 0
    _, cells, _ = run(costs, (0, 0), (4, 2), tolerance=0.0)
    _, mirrored, _ = run(costs[:, ::-1], (6, 0), (2, 2), tolerance=0.0)
    np.testing.assert_array_equal(mirrored, [[6 - c, r] for c, r in cells])


def test_moving_the_world_by_whole_cells_moves_the_path():
    costs = wall_map()
    larger = np.zeros((25, 24), dtype=np.uint8)
    larger[:] = LETHAL
    larger[5:, 4:] = costs
    _, cells, _ = run(costs, (2, 15), (17, 15))
    _, moved, _ = run(larger, (6, 20), (21, 20))
    np.testing.assert_array_equal(moved, cells + np.array([4, 5]))


def test_a_step_costs_its_length_times_the_entered_cell():
    table = step_costs(2.0, True)
    assert table[0, 0] == 1.0
    # 1 + 2 x 126 / 252 = 2; the diagonal sqrt 2 times as much.
    assert table[0, 126] == 2.0
    assert table[1, 126] == np.float32(2.0 * np.float32(math.sqrt(2.0)))
    assert table[0, UNKNOWN] == pytest.approx(1.0 + 2.0 * 255 / 252)
    assert np.isinf(table[:, [INSCRIBED, LETHAL]]).all()
    assert np.isinf(step_costs(2.0, False)[:, UNKNOWN]).all()


def test_costs_keep_the_path_in_the_middle_of_a_corridor():
    costs = np.zeros((7, 40), dtype=np.uint8)
    costs[:] = np.array([LETHAL, 200, 100, 10, 100, 200, LETHAL], dtype=np.uint8)[:, None]
    _, centred, _ = run(costs, (1, 1), (38, 1), cost_travel_multiplier=3.0)
    _, straight, _ = run(costs, (1, 1), (38, 1), cost_travel_multiplier=0.0)
    assert np.all(centred[5:-5, 1] == 3)
    assert np.all(straight[:, 1] == 1)


def test_a_diagonal_gap_of_no_width_is_passed_only_by_cutting_corners():
    costs = np.zeros((6, 6), dtype=np.uint8)
    costs[:3, 3] = LETHAL
    costs[3, 2] = LETHAL
    costs[3, :2] = LETHAL
    # The lower left room touches the rest at one corner, between cells (2, 2) and (3, 3).
    status, cells, _ = run(costs, (1, 1), (4, 4), corner_cutting=True)
    assert status == FOUND
    assert [2, 2] in cells.tolist()
    assert [3, 3] in cells.tolist()
    assert run(costs, (1, 1), (4, 4), tolerance=0.0)[0] == OPEN_SET_EMPTY


def test_without_corner_cutting_a_path_goes_round_the_corner_of_a_wall():
    costs = np.zeros((5, 5), dtype=np.uint8)
    costs[2, 2] = LETHAL
    _, cutting, _ = run(costs, (1, 2), (2, 3), corner_cutting=True)
    _, around, _ = run(costs, (1, 2), (2, 3))
    assert cutting.tolist() == [[1, 2], [2, 3]]
    assert around.tolist() == [[1, 2], [1, 3], [2, 3]]


@pytest.mark.parametrize(
    ("radius", "tolerance", "status"),
    [
        # The nearest free cells lie radius + 1 cells from the goal's cell.
        (1, 1.9, GOAL_OCCUPIED),
        (1, 2.1, FOUND),
        (2, 2.9, GOAL_OCCUPIED),
        (2, 3.1, FOUND),
    ],
)
def test_a_blocked_goal_is_admitted_where_a_free_cell_lies_within_tolerance(
    radius, tolerance, status
):
    costs = np.zeros((21, 21), dtype=np.uint8)
    costs[10 - radius : 11 + radius, 10 - radius : 11 + radius] = LETHAL
    result, cells, _ = run(costs, (2, 10), (10, 10), tolerance=tolerance)
    assert result == status
    if status == FOUND:
        assert math.dist(cells[-1], (10, 10)) == radius + 1


def test_a_tolerance_below_one_cell_never_relaxes_a_blocked_goal():
    costs = np.zeros((9, 9), dtype=np.uint8)
    costs[4, 4] = LETHAL
    # The free cell (5, 4) lies 0.1 cells from the goal at x = 4.9.
    assert run(costs, (0, 4), (4.9, 4.0), tolerance=0.9)[0] == GOAL_OCCUPIED
    assert run(costs, (0, 4), (4.9, 4.0), tolerance=1.0)[0] == FOUND


def test_the_goal_is_searched_on_within_tolerance_up_to_a_count():
    costs = np.zeros((40, 40), dtype=np.uint8)
    costs[15:26, 20] = LETHAL
    # The goal lies behind the wall: the cells (18, 20) and (19, 20) are near, the way round is far.
    goal = (21, 20)
    status, far, _ = run(costs, (2, 20), goal, tolerance=2.5, max_on_approach_iterations=0)
    _, near, _ = run(costs, (2, 20), goal, tolerance=2.5, max_on_approach_iterations=3)
    assert status == FOUND
    assert far[-1].tolist() == [21, 20]
    assert near[-1].tolist() == [19, 20]


def test_running_out_of_iterations_within_tolerance_is_a_success_and_else_a_failure():
    costs = np.zeros((40, 40), dtype=np.uint8)
    # Along a row each expansion advances one cell: 8 expansions relax up to cell 10.
    assert run(costs, (2, 20), (30, 20), max_iterations=8)[0] == ITERATION_LIMIT
    status, cells, expansions = run(costs, (2, 20), (12, 20), max_iterations=8)
    assert (status, expansions) == (FOUND, 8)
    assert cells[-1].tolist() == [10, 20]


def test_the_expansion_budget_is_looked_at_every_interval():
    costs = np.zeros((60, 60), dtype=np.uint8)
    status, _, expansions = run(
        costs, (2, 20), (50, 20), terminal_checking_interval=10, expansion_budget=15
    )
    assert (status, expansions) == (EXPANSION_BUDGET_SPENT, 20)
    status, _, expansions = run(
        costs, (2, 20), (50, 20), terminal_checking_interval=10, expansion_budget=0
    )
    assert (status, expansions) == (EXPANSION_BUDGET_SPENT, 0)


def test_an_enclosed_start_ends_after_one_expansion_and_a_start_in_a_wall_may_leave():
    enclosed = np.zeros((9, 9), dtype=np.uint8)
    enclosed[3:6, 3:6] = LETHAL
    status, _, expansions = run(enclosed, (4, 4), (8, 8))
    assert (status, expansions) == (OPEN_SET_EMPTY, 1)
    enclosed[4, 5] = 0
    assert run(enclosed, (4, 4), (8, 8))[0] == FOUND


def test_paths_do_not_wrap_around_the_edges_of_the_map():
    costs = np.zeros((5, 5), dtype=np.uint8)
    costs[:, 2] = LETHAL
    assert run(costs, (4, 2), (0, 2), tolerance=0.0)[0] == OPEN_SET_EMPTY


def test_the_open_set_grows_beyond_its_first_room():
    rng = np.random.default_rng(5)
    costs = rng.integers(0, 253, (300, 300)).astype(np.uint8)
    status, cells, expansions = run(costs, (0, 0), (299, 299), cost_travel_multiplier=3.0)
    assert status == FOUND
    assert expansions > 20_000
    least = brute_force(costs[:40, :40], (0, 0), 3.0, True, False)
    _, corner, _ = run(costs[:40, :40], (0, 0), (39, 39), cost_travel_multiplier=3.0)
    assert path_cost(costs, corner, 3.0) == pytest.approx(least[39, 39], rel=1e-5)
    assert len(cells) >= 300


def test_the_same_search_gives_the_same_cells_and_leaves_the_map_alone():
    rng = np.random.default_rng(6)
    costs = rng.integers(0, 255, (80, 80)).astype(np.uint8)
    before = costs.copy()
    first = run(costs, (1, 1), (70, 75))
    second = run(costs, (1, 1), (70, 75))
    np.testing.assert_array_equal(costs, before)
    np.testing.assert_array_equal(first[1], second[1])
