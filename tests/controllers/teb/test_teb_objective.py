import numpy as np
import pytest
from teb_bands import ZERO_WEIGHTS, make_scene, numeric_jacobian, random_band

from drake_navbench.controllers.teb.layout import pack_band
from drake_navbench.controllers.teb.objective import band_objective

TERMS = ["time", "length", "backwards", "via_point", "inflation", "smoothness", "slack"]


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("seed", range(4))
def test_gradient_of_every_term_agrees_with_finite_differences(term, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 9))
    z, scene = random_band(rng, count)
    weights = ZERO_WEIGHTS._replace(**{term: 1.5})
    _, gradient = band_objective(z, count, scene, weights)
    numeric = numeric_jacobian(lambda z: band_objective(z, count, scene, weights)[0], z)[0]
    np.testing.assert_allclose(gradient, numeric, atol=1e-6, rtol=1e-6)
    assert np.any(gradient != 0.0)


def cost_of(poses, steps, weights, **changes):
    scene = make_scene(poses[0], poses[-1])._replace(**changes)
    return band_objective(pack_band(poses, steps, 0.0), len(steps), scene, weights)[0]


def test_terms_are_the_sums_they_are_named_after():
    # x = 0, 0.3, 0.2, 0.5 m with heading 0: the second interval goes back by 0.1 m.
    poses = np.zeros((4, 3))
    poses[:, 0] = [0.0, 0.3, 0.2, 0.5]
    steps = np.array([0.5, 0.25, 0.5])
    zero = ZERO_WEIGHTS
    # 0.25 + 0.0625 + 0.25
    assert cost_of(poses, steps, zero._replace(time=2.0)) == pytest.approx(2.0 * 0.5625)
    # 0.09 + 0.01 + 0.09
    assert cost_of(poses, steps, zero._replace(length=1.0)) == pytest.approx(0.19)
    assert cost_of(poses, steps, zero._replace(backwards=3.0)) == pytest.approx(3.0 * 0.01)
    # Speeds 0.6, -0.4, 0.6 m/s: two changes of 1 m/s.
    assert cost_of(poses, steps, zero._replace(smoothness=1.0)) == pytest.approx(2.0)
    # The pose at (0.3, 0) and a via-point at (0.3, 0.4).
    via = {"via_points": np.array([[0.3, 0.4]]), "via_poses": np.array([1])}
    assert cost_of(poses, steps, zero._replace(via_point=1.0), **via) == pytest.approx(0.16)
