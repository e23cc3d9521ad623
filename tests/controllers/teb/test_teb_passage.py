"""What a band shall keep where the plan's way is too narrow for min_obstacle_dist."""

import numpy as np
import pytest
from teb_bands import map_of

from drake_navbench import run_trial
from drake_navbench.controllers.teb.local_plan import LocalPlan
from drake_navbench.controllers.teb.passage import Passage, plan_passage
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.distance_field import distance_field, path_clearance
from drake_navbench.logs.outcome import Outcome
from drake_navbench.typed_files.typed_yaml import validate

DISC = np.array([[0.0, 0.2]])
WANTED_M = 0.25


def passage_of(boxes, *, y=0.0, end_x=2.0):
    """Returns the passage of a plan along x from 0 to end_x at the height y among boxes."""
    field = distance_field(map_of(boxes))
    x = np.arange(0.0, end_x + 1e-9, 0.05)
    poses = np.column_stack([x, np.full_like(x, y), np.zeros_like(x)])
    plan = LocalPlan(
        poses=poses,
        clearances=path_clearance(field, DISC, poses),
        goal_index=len(poses) - 1,
        blocked_index=None,
        ends_plan=True,
    )
    return plan_passage(plan, field, DISC, WANTED_M)


def corridor(low, high):
    return [(-3.0, high, 3.0, high + 0.2), (-3.0, low - 0.2, 3.0, low)]


def test_in_a_corridor_all_is_kept_that_its_middle_has_but_half_a_cell():
    # Cell centres lie 0.325 m from the faces at y = -0.35 and 0.35 m: 0.325 - 0.2 - 0.025 m.
    passage = passage_of(corridor(-0.35, 0.35))
    assert len(passage.points) == 41
    np.testing.assert_allclose(passage.shares, 0.1 / WANTED_M)


def test_a_plan_beside_the_middle_is_asked_for_what_the_middle_has_and_its_goal_for_what_it_has():
    # At y = 0.1 the disc is 0.25 - 0.2 = 0.05 m from the face, in the middle 0.125 m.
    passage = passage_of(corridor(-0.35, 0.35), y=0.1)
    np.testing.assert_allclose(passage.shares[:-2], 0.1 / WANTED_M)
    # Every 0.05 m before the goal adds as much to the goal's clearance.
    np.testing.assert_allclose(passage.shares[-2:], [0.075 / WANTED_M, 0.025 / WANTED_M])


def test_beside_a_single_wall_min_obstacle_dist_is_asked_for():
    # 0.05 m from the wall, and free on the other side; the goal alone must be so near.
    passage = passage_of([(-3.0, 0.25, 3.0, 0.45)])
    assert passage.points[:, 0].min() > 2.0 - WANTED_M
    assert len(passage_of([(-3.0, 0.25, 1.5, 0.45)]).points) == 0


def test_the_room_beyond_a_thin_wall_does_not_count():
    # A wall of one cell to the left, free space behind it.
    thin = [(-3.0, 0.3, 3.0, 0.35), (-3.0, -0.5, 3.0, -0.3)]
    assert passage_of(thin).shares.max() == pytest.approx(0.05 / WANTED_M)


def test_a_wide_way_is_no_passage():
    assert len(passage_of(corridor(-0.5, 0.5)).points) == 0


def test_poses_far_from_the_narrow_places_keep_all():
    passage = Passage(np.array([[1.0, 0.0], [1.1, 0.0]]), np.array([0.5, 0.3]))
    poses = np.array([[0.8, 0.0, 0.0], [0.9, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.2, 0.0]])
    np.testing.assert_array_equal(passage.shares_at(poses), [1.0, 0.5, 0.3, 1.0])


def corridor_task(width_m, middle_y):
    walls = [
        {"type": "box", "min": [-1.0, middle_y + 0.5 * width_m], "max": [6.0, 1.0]},
        {"type": "box", "min": [-1.0, -1.0], "max": [6.0, middle_y - 0.5 * width_m]},
    ]
    return validate(
        Scenario,
        {
            "name": "corridor",
            "description": "a straight corridor",
            "world": {"obstacles": walls},
            "goal": [2.5, 0.0, 0.0],
            "plan": {"type": "polyline", "points": [[0.0, 0.0], [2.5, 0.0]]},
            "timeout_s": 20.0,
        },
        "corridor.yaml",
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("width_m", "middle_y"),
    # 0.18 m of room to either side, and 0.27 m where the goal lies beside the middle.
    [(0.8, 0.0), (0.98, 0.02)],
)
def test_a_round_robot_drives_a_narrow_corridor_to_its_goal(width_m, middle_y):
    log = run_trial(corridor_task(width_m, middle_y), "teb", seed=1, robot="round_robot")
    assert log.outcome is Outcome.SUCCEEDED
    # 2.25 m at 0.5 m/s, and 0.17 s to get there at 1.5 m/s^2.
    assert log.end_time_s < 5.0
    assert log.samples["clearance_m"].min() > 0.5 * width_m - 0.22 - middle_y - 0.005


def test_a_wheelchair_gets_through_a_door_with_half_of_min_obstacle_dist_to_either_side():
    log = run_trial("doorway", "teb", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
    # The door leaves 0.15 m to either side.
    assert log.samples["clearance_m"].min() > 0.08
