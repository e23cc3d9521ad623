"""Critics and validator with an outline, and on unknown cells."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mppi_scenes import batch_of, critic_of, round_robot, scene_of
from scenes import straight_plan

from drake_navbench.controllers.mppi.validator import is_trajectory_clear
from drake_navbench.errors import InputError
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.kernels.grid import Costmap

LETHAL, UNKNOWN = 254, 255
OUTLINE = np.array([[0.42, 0.22], [0.42, -0.22], [-0.42, -0.22], [-0.42, 0.22]])
INFLATION_M, DECAY = 0.7, 3.0


def long_robot(**changes):
    """A rectangle of 0.84 m x 0.44 m: inscribed radius 0.22 m."""
    inscribed_radius_m, circumscribed_radius_m = footprint_radii(OUTLINE)
    values = {
        "footprint": OUTLINE,
        "inscribed_radius_m": inscribed_radius_m,
        "circumscribed_radius_m": circumscribed_radius_m,
        "footprint_is_circle": False,
        "inflation_radius_m": INFLATION_M,
        "inflation_cost_scaling_factor": DECAY,
    }
    return round_robot(**{**values, **changes})


def map_with(*, centre, at_corner=0):
    """A value at the origin's cell, another where the front left corner of the outline is."""
    costs = np.zeros((60, 60), np.uint8)
    costs[30, 30] = centre
    costs[34, 38] = at_corner  # x in [0.40, 0.45), y in [0.20, 0.25)
    return costs


def standing(costs, *, yaw=0.0, tracks_unknown=False):
    """One sample of two columns that stands at (0.01, 0.01)."""
    scene = scene_of(straight_plan(1.45))
    costmap = Costmap(costs, -1.5, -1.5, 0.05, tracks_unknown=tracks_unknown)
    scene = type(scene).from_plan(straight_plan(1.45), pose=(0.0, 0.0, 0.0), costmap=costmap)
    return batch_of(scene, x=[0.01, 0.01], y=0.01, yaw=yaw)


def score(critic, batch):
    costs, fail = critic.score(batch)
    return float(costs[0]), fail


def cost_critic(**parameters):
    # Both columns are looked at: a value v costs v x 3.81 / 254 on average.
    return critic_of(
        "CostCritic",
        setup=long_robot(),
        steps=2,
        consider_footprint=True,
        trajectory_point_step=1,
        **parameters,
    )


def test_cost_looks_at_the_outline_where_the_centre_is_near_enough():
    # The circumscribed radius 0.474 m inflates to 252 exp(-3 x 0.254) = 117.
    assert long_robot().circumscribed_radius_m == pytest.approx(0.4741, abs=1e-4)
    assert score(cost_critic(), standing(map_with(centre=150, at_corner=LETHAL)))[1]
    assert not score(cost_critic(), standing(map_with(centre=100, at_corner=LETHAL)))[1]


def test_cost_scores_the_centre_even_with_an_outline():
    cost, fail = score(cost_critic(), standing(map_with(centre=150, at_corner=200)))
    assert (cost, fail) == (pytest.approx(150 * 3.81 / 254, rel=1e-5), False)


def test_the_outline_turns_with_the_robot():
    crosswise = standing(map_with(centre=150, at_corner=LETHAL), yaw=math.pi / 2)
    assert not score(cost_critic(), crosswise)[1]


def test_with_too_little_inflation_cost_always_looks_at_the_outline():
    critic = critic_of(
        "CostCritic",
        setup=long_robot(inflation_radius_m=0.3),
        steps=2,
        consider_footprint=True,
        trajectory_point_step=1,
    )
    assert score(critic, standing(map_with(centre=1, at_corner=LETHAL)))[1]
    assert not score(critic, standing(map_with(centre=0, at_corner=LETHAL)))[1]


def test_obstacles_measures_from_the_outline():
    # The outline's value 250 replaces the centre's: d = 0.22 - ln(250 / 253) / 3 = 0.22398 m,
    # 0.07602 m short of a margin of 0.3 m, on both columns, times 20.
    critic = critic_of(
        "ObstaclesCritic",
        setup=long_robot(),
        steps=2,
        consider_footprint=True,
        collision_margin_distance=0.3,
    )
    cost, fail = score(critic, standing(map_with(centre=150, at_corner=250)))
    assert (cost, fail) == (pytest.approx(2 * 20 * 0.076023, rel=1e-3), False)
    assert score(critic, standing(map_with(centre=150, at_corner=LETHAL))) == (
        pytest.approx(20 * 1e5),
        True,
    )


def test_unknown_is_a_collision_unless_the_map_tracks_it():
    # Tracked, it counts as near collision: 300 x 3.81 / 254 = 4.5.
    critic = critic_of("CostCritic", steps=2, trajectory_point_step=1)
    unknown = np.full((60, 60), UNKNOWN, np.uint8)
    assert score(critic, standing(unknown))[1]
    assert score(critic, standing(unknown, tracks_unknown=True)) == (
        pytest.approx(4.5, rel=1e-5),
        False,
    )


def test_unknown_path_points_are_free_where_the_map_tracks_them():
    unknown = np.full((60, 60), UNKNOWN, np.uint8)
    assert not standing(unknown).scene.path_valid.any()
    assert standing(unknown, tracks_unknown=True).scene.path_valid.all()


@pytest.mark.parametrize("name", ["CostCritic", "ObstaclesCritic"])
def test_a_round_robot_has_no_outline_to_check(name):
    with pytest.raises(InputError, match=f"{name}.consider_footprint"):
        critic_of(name, consider_footprint=True)


@pytest.mark.parametrize(
    ("value", "at_centre", "under_outline"),
    [(LETHAL, False, False), (253, False, True), (UNKNOWN, True, True), (252, True, True)],
)
def test_the_validator_judges_centre_and_outline_by_different_values(
    value, at_centre, under_outline
):
    poses = np.array([[0.01, 0.01, 0.0]], np.float32)

    def clear(costs, consider_footprint):
        grid = Costmap(costs, -1.5, -1.5, 0.05).grid
        return is_trajectory_clear(grid, OUTLINE, poses, 1, consider_footprint)

    assert clear(map_with(centre=value), False) is at_centre
    assert clear(map_with(centre=0, at_corner=value), True) is under_outline


def test_off_the_map_only_the_outline_is_refused():
    poses = np.array([[1.6, 0.0, 0.0]], np.float32)
    grid = Costmap(np.zeros((60, 60), np.uint8), -1.5, -1.5, 0.05).grid
    assert is_trajectory_clear(grid, OUTLINE, poses, 1, False)
    assert not is_trajectory_clear(grid, OUTLINE, poses, 1, True)
