import numpy as np
from scenes import WHEELCHAIR

from drake_navbench.controllers.teb.footprint_model import footprint_discs


def test_wheelchair_becomes_two_discs_that_touch_its_sides():
    # 1.1 x 0.6 m, from -0.25 to 0.85: radius 0.3 at -0.25 + 0.3 and 0.85 - 0.3.
    np.testing.assert_allclose(footprint_discs(WHEELCHAIR), [[0.05, 0.3], [0.55, 0.3]])


def test_a_square_becomes_the_disc_around_its_corners():
    square = np.array([[0.3, 0.3], [0.3, -0.3], [-0.3, -0.3], [-0.3, 0.3]])
    np.testing.assert_allclose(footprint_discs(square), [[0.0, 0.3 * np.sqrt(2.0)]])
