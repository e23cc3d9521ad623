"""The reward of a step, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.studies.gymnasium.reward import Moment, RewardWeights, moment, step_reward

NOTHING = dict.fromkeys(("progress", "heading", "time", "nearness", "turning"), 0.0)
FAR = Moment(distance_m=4.0, heading_error_rad=1.0, clearance_m=1.0)


def reward(weights, before=FAR, after=FAR, **values):
    asked = {"turn_change_radps": 0.0, "has_reached": False, "has_collided": False}
    given = RewardWeights(**(NOTHING | weights))
    return step_reward(
        given, before, after, duration_s=0.1, **(asked | {"time_left_s": 0.0} | values)
    )


def test_a_moment_is_measured_to_the_goal():
    at = moment(np.array([1.0, 1.0, 3.0]), np.array([4.0, 5.0, -3.0]), 0.2)
    assert at.distance_m == 5.0
    assert at.heading_error_rad == pytest.approx(2.0 * math.pi - 6.0)


@pytest.mark.parametrize(
    ("weights", "values", "expected"),
    [
        ({"progress": 2.0}, {"after": FAR._replace(distance_m=3.75)}, 0.5),
        ({"time": -0.05}, {}, -0.005),
        # Half of 0.3 m is left.
        ({"nearness": -0.5}, {"after": FAR._replace(clearance_m=0.15)}, -0.025),
        ({"nearness": -0.5}, {}, 0.0),
        ({"turning": -0.01}, {"turn_change_radps": -2.0}, -0.02),
        ({}, {"has_reached": True}, 5.0),
        ({}, {"has_collided": True}, -5.0),
    ],
)
def test_each_part_counts_by_its_weight(weights, values, expected):
    assert reward(weights, **values) == pytest.approx(expected)


def test_touching_something_at_once_is_worse_than_standing_still_until_the_time_limit():
    """120 s at -0.05 a second are -6; the touch costs 5 besides, and gains no time."""
    standing = sum(reward({"time": -0.05}) for _ in range(1200))
    touching = reward({"time": -0.05}, has_collided=True, time_left_s=119.9)
    assert (standing, touching) == (pytest.approx(-6.0), pytest.approx(-11.0))
    # A weight that rewards each second, as for staying alive, gives none for the rest.
    assert reward({"time": 0.05}, has_collided=True, time_left_s=119.9) == pytest.approx(-4.995)


def test_the_heading_counts_at_the_goal_and_hardly_far_away():
    near = FAR._replace(distance_m=0.0)
    turned = near._replace(heading_error_rad=0.25)
    assert reward({"heading": 0.5}, near, turned) == pytest.approx(0.375)
    assert abs(reward({"heading": 0.5}, FAR, FAR._replace(heading_error_rad=0.0))) < 1e-12
