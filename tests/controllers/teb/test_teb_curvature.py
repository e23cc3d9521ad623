"""The second derivatives of a band's Lagrangian against differences of its first ones."""

import numpy as np
import pytest
from teb_bands import WEIGHTS, ZERO_WEIGHTS, numeric_jacobian, random_band

from drake_navbench.controllers.teb.arcs import arc_curvature, arc_ratio
from drake_navbench.controllers.teb.constraints import band_constraints
from drake_navbench.controllers.teb.curvature import (
    add_lagrangian_curvature,
    band_positions,
)
from drake_navbench.controllers.teb.layout import row_count
from drake_navbench.controllers.teb.objective import band_objective
from drake_navbench.kernels.band_cholesky import BANDWIDTH

INTERVALS = 7
# The terms whose curvature is taken as a whole, with inflation beyond its kink or not.
EXACT = WEIGHTS._replace(backwards=0.0, length=0.3)


def full(matrix, positions):
    """Returns the symmetric (N - 1, N - 1) matrix of a lower band matrix, in the columns' order."""
    size = len(matrix)
    dense = np.zeros((size, size))
    for row in range(size):
        for below in range(min(row, BANDWIDTH) + 1):
            dense[row, row - below] = dense[row - below, row] = matrix[row, below]
    return dense[np.ix_(positions, positions)]


@pytest.mark.parametrize("is_car", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_curvature_is_the_slope_of_the_lagrangians_gradient(seed, is_car):
    rng = np.random.default_rng(seed)
    z, scene = random_band(rng, INTERVALS)
    if is_car:
        scene = scene._replace(turning_radius=0.7, directions=rng.choice([-1.0, 1.0], INTERVALS))
    multipliers = rng.normal(size=row_count(INTERVALS, len(scene.discs), is_car))

    def gradient(at):
        _, jacobian = band_constraints(at, INTERVALS, scene)
        return band_objective(at, INTERVALS, scene, EXACT)[1] + multipliers @ jacobian

    positions = band_positions(INTERVALS)
    matrix = np.zeros((4 * INTERVALS - 3, BANDWIDTH + 1))
    add_lagrangian_curvature(z, INTERVALS, scene, EXACT, multipliers, positions, matrix)
    expected = numeric_jacobian(gradient, z)
    assert np.abs(expected[-1]).max() < 1e-6
    np.testing.assert_allclose(
        full(matrix, positions[:-1]), expected[:-1, :-1], rtol=1e-5, atol=1e-4
    )


def test_backward_motion_curves_upwards_alone():
    z, scene = random_band(np.random.default_rng(3), INTERVALS)
    weights = ZERO_WEIGHTS._replace(backwards=1.0)
    matrix = np.zeros((4 * INTERVALS - 3, BANDWIDTH + 1))
    positions = band_positions(INTERVALS)
    none = np.zeros(row_count(INTERVALS, len(scene.discs)))
    add_lagrangian_curvature(z, INTERVALS, scene, weights, none, positions, matrix)
    eigenvalues = np.linalg.eigvalsh(full(matrix, positions[:-1]))
    assert eigenvalues.min() > -1e-9
    assert eigenvalues.max() > 0.1


@pytest.mark.parametrize("delta", [0.0, 1e-4, 0.0199, 0.0201, -0.5, 2.0])
def test_curvature_of_the_arc_ratio_is_the_slope_of_its_slope(delta):
    step = 1e-5
    expected = (arc_ratio(delta + step)[1] - arc_ratio(delta - step)[1]) / (2.0 * step)
    assert arc_curvature(delta) == pytest.approx(expected, abs=1e-6)
