"""Each term has the derivatives that it says, and alone changes the motion as its name says."""

from __future__ import annotations

import numpy as np
import pytest
from harmony_scenes import DISCS, arc, problem, straight

from drake_navbench.controllers.harmony.interior_point import SolverSettings, solve
from drake_navbench.controllers.harmony.motion import JERK, YAW, A, V, W, X, Y
from drake_navbench.controllers.harmony.terms import TERMS, stage_cost
from drake_navbench.kernels.distance_field import path_clearance

SETTINGS = SolverSettings(80, 1e-2, 1e-6, 1e-2)
BOX = (1.0, 0.45, 1.4, 0.9)


def plan_with(term: str, weight: float, **scene) -> np.ndarray:
    """The plan where one weight is as given and the others are as they come."""
    solution = solve(*problem(weights={term: weight}, **scene), SETTINGS)
    assert solution.solved
    return solution.plan


def near_limits(plan):
    return np.abs(plan[:, A]).max()


def angle_at_end(plan):
    return abs(plan[-1, YAW] - 0.6)


def way_left(plan):
    return np.hypot(plan[-1, X] - 1.5, plan[-1, Y])


def closeness(plan):
    return -path_clearance(problem(boxes=[BOX])[0].field, DISCS, plan[:, :3]).min()


def mean_offset(plan):
    return np.abs(plan[:, Y]).mean()


def mean_heading(plan):
    return np.abs(plan[:, YAW]).mean()


def backing_up(plan):
    return -min(plan[:, V].min(), 0.0)


def turning(plan):
    return np.abs(plan[:, W]).max()


def power(plan):
    return np.sum((plan[:, V] * plan[:, A]) ** 2)


def curvature(plan):
    return np.sum((plan[1:-1, W] / np.hypot(plan[1:-1, V], 0.15)) ** 2)


def jerk(plan):
    return np.sum(plan[:, JERK] ** 2)


def slowness(plan):
    return -plan[:, V].mean()


# Of each term: what gets less where its weight goes from the first to the second, and where.
BEHIND = {"goal": (-0.6, 0.0, 0.0), "path": np.array([[-0.6, 0.0, 0.0], [-0.6, 0.0, 0.0]])}
CHANGES = {
    "constraints": (near_limits, 0.0, 30.0, {"limit_share": 0.3}),
    "goal_angle": (angle_at_end, 0.0, 20.0, {"goal": (1.0, 0.0, 0.6), "path": straight(1.0)}),
    "goal_position": (way_left, 0.0, 20.0, {"weights_off": "maximum_velocity"}),
    "costmap_cost": (closeness, 0.0, 20.0, {"boxes": [BOX]}),
    "path_alignment": (mean_offset, 0.1, 50.0, {"start": (0.0, 0.2, 0.0)}),
    "path_orientation": (mean_heading, 0.0, 20.0, {"start": (0.0, 0.2, 0.3)}),
    "forward_preference": (backing_up, 0.0, 50.0, {**BEHIND, "speed": 0.0}),
    "twirling": (turning, 0.0, 5.0, {"start": (0.0, 0.0, 0.8)}),
    "energy": (power, 0.0, 50.0, {}),
    "sharp_curves": (curvature, 0.0, 2.0, {"path": arc()}),
    "linear_jerk": (jerk, 0.001, 1.0, {}),
    "maximum_velocity": (slowness, 0.0, 20.0, {}),
}


@pytest.mark.parametrize("term", TERMS)
def test_a_term_alone_changes_the_motion_as_its_name_says(term):
    measure, less, more, scene = CHANGES[term]
    scene = dict(scene)
    off = scene.pop("weights_off", None)
    if off:
        with_less = solve(*problem(weights={off: 0.0, term: less}, **scene), SETTINGS).plan
        with_more = solve(*problem(weights={off: 0.0, term: more}, **scene), SETTINGS).plan
    else:
        with_less = plan_with(term, less, **scene)
        with_more = plan_with(term, more, **scene)
    assert measure(with_more) < 0.95 * measure(with_less) - 1e-6 or (
        measure(with_less) < 0.0 and measure(with_more) < 1.02 * measure(with_less)
    )


@pytest.mark.parametrize("term", TERMS)
def test_the_gradient_of_a_term_is_its_derivative(term):
    weights = dict.fromkeys(TERMS, 0.0) | {term: 1.7}
    scene, guess = problem(
        weights=weights, boxes=[BOX], goal=(1.2, 0.0, 0.4), path=straight(1.2), limit_share=0.1
    )
    last = len(guess) - 1
    k = last if term.startswith("goal") else 14
    stage = guess[k].copy()
    stage[:] += [0.02, 0.21, 0.3, -0.1, 0.4, 0.2, -0.3, 0.5, 0.2]
    stage[V] = -0.12 if term == "forward_preference" else 0.31
    stage[X] = 0.6

    def cost(at):
        gradient, hessian = np.zeros(9), np.zeros((9, 9))
        value = stage_cost(scene, k, last, at, scene.references[k], gradient, hessian)
        return value, gradient, hessian

    value, gradient, hessian = cost(stage)
    assert value > 0.0
    steps = 1e-6 * np.eye(9)
    numeric = [(cost(stage + d)[0] - cost(stage - d)[0]) / 2e-6 for d in steps]
    np.testing.assert_allclose(gradient, numeric, atol=1e-6)
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12)
    assert np.linalg.eigvalsh(hessian).min() > -1e-12


def test_a_weight_of_zero_leaves_a_term_out():
    scene, guess = problem(weights=dict.fromkeys(TERMS, 0.0), boxes=[BOX])
    gradient, hessian = np.zeros(9), np.zeros((9, 9))
    assert stage_cost(scene, 5, 30, guess[5], scene.references[5], gradient, hessian) == 0.0
    assert not gradient.any()
    assert not hessian.any()
