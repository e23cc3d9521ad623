"""The Savitzky-Golay smoother: what it keeps, how it weighs, what it refuses."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from drake_navbench.errors import InputError
from drake_navbench.navigation.smoother_parameters import SavitzkyGolaySmootherParameters
from drake_navbench.navigation.smoothers import SavitzkyGolaySmoother, window_weights

DEFAULT = SavitzkyGolaySmootherParameters()
ONCE = SavitzkyGolaySmootherParameters(do_refinement=False)


def smooth_path(path, parameters):
    return SavitzkyGolaySmoother(parameters).smooth(path)


def bump(count=20, yaw=0.0):
    """Poses every 10 cm along x, the eleventh 7 cm up."""
    path = np.zeros((count, 3))
    path[:, 0] = 0.1 * np.arange(count)
    path[10, 1] = 0.07
    path[:, 2] = yaw
    return path


def test_a_window_of_seven_has_the_weights_of_the_textbook():
    # Savitzky and Golay (1964), table I: quadratic and cubic, 7 points.
    expected = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0
    np.testing.assert_allclose(window_weights(7, 3), expected, atol=1e-14)
    np.testing.assert_allclose(window_weights(7, 2), expected, atol=1e-14)
    np.testing.assert_allclose(window_weights(3, 1), np.full(3, 1.0 / 3.0), atol=1e-14)


def test_one_pose_aside_is_spread_by_the_weights():
    smoothed = smooth_path(bump(), ONCE)
    expected = np.array([0.0, -2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0, 0.0]) * 0.07 / 21.0
    np.testing.assert_allclose(smoothed[6:15, 1], expected, atol=1e-14)
    np.testing.assert_allclose(smoothed[4:-4, 0], bump()[4:-4, 0], atol=1e-14)


def test_beyond_the_ends_the_end_is_repeated_and_stays_itself():
    smoothed = smooth_path(bump(), ONCE)
    # -2 and 3 of 21 count for poses that are not there: (7 * 1 + 6 * 2 + 3 * 3 - 2 * 4) / 21.
    assert smoothed[1, 0] == pytest.approx(0.1 * 20.0 / 21.0)
    np.testing.assert_array_equal(smoothed[[0, -1], :2], bump()[[0, -1], :2])


@pytest.mark.parametrize("release", ["humble", "iron"])
def test_up_to_iron_points_are_read_that_were_moved_before(release):
    parameters = SavitzkyGolaySmootherParameters(nav2_release=release, do_refinement=False)
    height = smooth_path(bump(), parameters)[:, 1] / 0.07
    # The eighth point sees only the bump, by -2/21; the ninth the bump by 3/21, the eighth by 6/21.
    assert height[7] == pytest.approx(-2.0 / 21.0)
    assert height[8] == pytest.approx(3.0 / 21.0 - 2.0 / 21.0 * 6.0 / 21.0)


def test_up_to_iron_the_fourth_point_from_the_end_stays():
    path = np.zeros((20, 3))
    path[:, 0] = 0.1 * np.arange(20)
    path[16, 1] = 0.07
    parameters = SavitzkyGolaySmootherParameters(nav2_release="iron", do_refinement=False)
    assert smooth_path(path, parameters)[16, 1] == 0.07
    assert smooth_path(path, ONCE)[16, 1] == pytest.approx(0.07 * 7.0 / 21.0)


@pytest.mark.parametrize("release", ["jazzy", "kilted"])
def test_jazzys_window_is_the_one_that_lyrical_has_by_default(release):
    older = smooth_path(bump(), SavitzkyGolaySmootherParameters(nav2_release=release))
    np.testing.assert_allclose(older, smooth_path(bump(), DEFAULT), atol=1e-14)


def test_each_refinement_smooths_what_came_before():
    twice = SavitzkyGolaySmootherParameters(refinement_num=1)
    by_hand = smooth_path(smooth_path(bump(), ONCE), ONCE)
    np.testing.assert_allclose(smooth_path(bump(), twice)[:, :2], by_hand[:, :2], atol=1e-14)
    heights = [np.ptp(smooth_path(bump(), p)[:, 1]) for p in (ONCE, DEFAULT)]
    assert heights[1] < heights[0]


def test_a_cubic_stays_but_at_its_ends():
    path = np.zeros((30, 3))
    path[:, 0] = np.linspace(0.0, 2.9, 30)
    path[:, 1] = 0.1 * path[:, 0] ** 3 - 0.2 * path[:, 0] ** 2
    smoothed = smooth_path(path, ONCE)
    np.testing.assert_allclose(smoothed[3:-3, :2], path[3:-3, :2], atol=1e-13)


@pytest.mark.parametrize(("yaw", "cosine"), [(0.0, 1.0), (math.pi, -1.0)])
def test_headings_follow_the_path_forwards_or_backwards(yaw, cosine):
    smoothed = smooth_path(bump(yaw=yaw), DEFAULT)
    assert np.all(cosine * np.cos(smoothed[:, 2]) > 0.8)


def test_the_pose_where_a_path_turns_back_stays():
    forward = bump(15)
    path = np.vstack([forward, forward[-2::-1] + np.array([0.0, 0.05, 0.0])])
    assert smooth_path(path, DEFAULT)[14, 0] == path[14, 0]
    whole = SavitzkyGolaySmootherParameters(enforce_path_inversion=False)
    assert smooth_path(path, whole)[14, 0] < path[14, 0] - 0.02


def test_a_part_of_ten_poses_stays_as_it_is_and_one_of_eleven_does_not():
    shorter, longer = bump(11)[1:], bump(11)
    shorter[5, 1] = longer[5, 1] = 0.05
    np.testing.assert_array_equal(smooth_path(shorter, DEFAULT), shorter)
    assert np.any(smooth_path(longer, DEFAULT) != longer)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"window_size": 6}, "expected an odd number"),
        ({"window_size": 1}, "greater than or equal to 3"),
        ({"window_size": 5, "poly_order": 5}, "expected less than window_size 5"),
        ({"nav2_release": "jazzy", "window_size": 9}, "jazzy has no other window"),
    ],
)
def test_windows_that_make_no_filter_are_refused(wrong, text):
    with pytest.raises(ValidationError, match=text):
        SavitzkyGolaySmootherParameters(**wrong)


def test_what_is_no_path_is_refused():
    with pytest.raises(InputError, match=r"expected \(N, 3\)"):
        smooth_path(np.zeros((0, 3)), DEFAULT)
