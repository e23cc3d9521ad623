"""The standalone simple smoother: what it keeps, what it cuts, what it refuses."""

import math

import numpy as np
import pytest

from drake_navbench.errors import InputError
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.navigation.smoother import SmoothingError
from drake_navbench.navigation.smoothers import SimpleSmoother, SimpleSmootherParameters

EMPTY = Costmap(np.zeros((100, 100), dtype=np.uint8), 0.0, 0.0, 0.05)
DEFAULT = SimpleSmootherParameters()


def smooth_path(path, costmap, parameters):
    return SimpleSmoother(parameters).smooth(path, costmap)


def zig_zag(count=20, yaw=0.0):
    """Poses every 10 cm along x, every second one 4 cm up."""
    path = np.zeros((count, 3))
    path[:, 0] = 1.0 + 0.1 * np.arange(count)
    path[:, 1] = 2.0 + 0.04 * (np.arange(count) % 2)
    path[:, 2] = yaw
    return path


def there_and_back():
    """Forward along y = 2 to x = 2, then in reverse along y = 2.1 towards smaller x."""
    forward = zig_zag(11)
    back = forward[-2::-1] + np.array([0.0, 0.1, 0.0])
    return np.vstack([forward, back])


def test_a_zig_zag_becomes_nearly_straight_and_headed_along_itself():
    path = zig_zag()
    smoothed = smooth_path(path, EMPTY, DEFAULT)
    assert np.ptp(smoothed[6:-6, 1]) < 0.1 * np.ptp(path[:, 1])
    np.testing.assert_allclose(smoothed[3:-3, 2], 0.0, atol=0.05)
    np.testing.assert_array_equal(smoothed[[0, -1], :2], path[[0, -1], :2])


def test_a_path_driven_in_reverse_keeps_pointing_backwards():
    smoothed = smooth_path(zig_zag(yaw=math.pi), EMPTY, DEFAULT)
    assert np.all(np.cos(smoothed[:, 2]) < -0.9)


def test_the_pose_where_a_path_turns_back_stays_and_headings_do_not_flip():
    path = there_and_back()
    smoothed = smooth_path(path, EMPTY, DEFAULT)
    np.testing.assert_array_equal(smoothed[10, :2], path[10, :2])
    assert np.all(np.cos(smoothed[:, 2]) > 0.5)


def test_without_path_inversion_the_turning_point_is_smoothed_away():
    path = there_and_back()
    parameters = SimpleSmootherParameters(enforce_path_inversion=False)
    assert smooth_path(path, EMPTY, parameters)[10, 0] < path[10, 0] - 0.02


def test_a_path_of_four_poses_stays_as_it_is_and_one_of_five_does_not():
    np.testing.assert_array_equal(smooth_path(zig_zag(4), EMPTY, DEFAULT), zig_zag(4))
    assert np.any(smooth_path(zig_zag(5), EMPTY, DEFAULT) != zig_zag(5))


@pytest.mark.parametrize("release", ["humble", "iron"])
def test_up_to_iron_a_path_of_ten_poses_is_too_short_and_one_of_eleven_is_not(release):
    parameters = SimpleSmootherParameters(nav2_release=release)
    assert np.any(smooth_path(zig_zag(11), EMPTY, parameters) != zig_zag(11))
    if release == "iron":
        with pytest.raises(SmoothingError, match="no part of the path was smoothed"):
            smooth_path(zig_zag(10), EMPTY, parameters)
    else:
        np.testing.assert_array_equal(smooth_path(zig_zag(10), EMPTY, parameters), zig_zag(10))


def test_iron_refuses_a_path_whose_first_sweep_meets_an_obstacle():
    wall = Costmap(np.full((100, 100), LETHAL, dtype=np.uint8), 0.0, 0.0, 0.05)
    assert len(smooth_path(zig_zag(), wall, DEFAULT)) == 20
    with pytest.raises(SmoothingError):
        smooth_path(zig_zag(), wall, SimpleSmootherParameters(nav2_release="iron"))


def test_in_humble_the_first_part_uses_up_the_refinements_of_all():
    path = there_and_back()
    humble = SimpleSmootherParameters(nav2_release="humble", refinement_num=1)
    once = SimpleSmootherParameters(refinement_num=1)
    never = SimpleSmootherParameters(do_refinement=False)
    smoothed = smooth_path(path, EMPTY, humble)
    np.testing.assert_array_equal(smoothed[:10], smooth_path(path, EMPTY, once)[:10])
    np.testing.assert_array_equal(smoothed[11:], smooth_path(path, EMPTY, never)[11:])


def test_in_humble_parts_behind_one_that_meets_an_obstacle_stay_as_they_are():
    path = there_and_back()
    costs = np.zeros((100, 100), dtype=np.uint8)
    # Both parts pass x = 1.5 m: the first at y = 2.04 m, the second at 2.14 m.
    costs[40:42, 29:32] = LETHAL
    wall = Costmap(costs, 0.0, 0.0, 0.05)
    humble = SimpleSmootherParameters(nav2_release="humble")
    np.testing.assert_array_equal(smooth_path(path, wall, humble)[11:], path[11:])
    assert np.any(smooth_path(path, wall, DEFAULT)[11:] != path[11:])


def test_more_refinements_smooth_more():
    roughness = [
        np.sum(np.diff(smooth_path(zig_zag(), EMPTY, parameters)[:, 1], n=2) ** 2)
        for parameters in (
            SimpleSmootherParameters(do_refinement=False),
            SimpleSmootherParameters(refinement_num=1),
            DEFAULT,
        )
    ]
    assert roughness[0] > roughness[1] > roughness[2]


def test_the_input_is_left_alone():
    path = zig_zag()
    smooth_path(path, EMPTY, DEFAULT)
    np.testing.assert_array_equal(path, zig_zag())


@pytest.mark.parametrize("path", [np.zeros((0, 3)), np.zeros((5, 2)), np.zeros(3)])
def test_an_array_that_is_no_path_is_refused(path):
    with pytest.raises(InputError, match="path: got an array of shape"):
        smooth_path(path, EMPTY, DEFAULT)
