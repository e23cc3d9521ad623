"""Bursts of beams that drop out, and beams that are stuck."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.ray_casting import burst_dropouts, stuck_ranges


@pytest.mark.parametrize("burst_beams", [2, 10, 40])
def test_the_share_of_beams_that_drop_out_is_as_asked_whatever_the_bursts(burst_beams):
    generator = np.random.default_rng(0)
    shares = [burst_dropouts(generator.random(360), 0.3, burst_beams).mean() for _ in range(400)]
    # Of a scan the share spreads by sqrt(0.3 0.7 / (360 / burst_beams)) or a little more.
    assert np.mean(shares) == pytest.approx(0.3, abs=0.02)


def test_a_burst_goes_round_from_the_last_beam_to_the_first():
    uniform = np.array([1.0, 1.0, 1.0, 1.0, 0.0])
    # Of 3 beams, and with a share for which only the last beam's draw begins one.
    dropped = burst_dropouts(uniform, 0.1, 3)
    np.testing.assert_array_equal(dropped, [True, True, False, False, True])


@given(st.integers(1, 50), st.integers(1, 80), st.floats(0.0, 1.0), st.integers(0, 99))
def test_no_beam_drops_out_at_share_0_and_every_one_at_1(beams, burst_beams, share, seed):
    uniform = np.random.default_rng(seed).random(beams)
    assert not burst_dropouts(uniform, 0.0, burst_beams).any()
    assert burst_dropouts(uniform, 1.0, burst_beams).all()
    fewer = burst_dropouts(uniform, 0.5 * share, burst_beams)
    assert not (fewer & ~burst_dropouts(uniform, share, burst_beams)).any()


def test_the_share_of_stuck_beams_is_as_asked_and_the_others_work():
    stuck = stuck_ranges(np.random.default_rng(0), 10_000, 0.2, 12.0)
    assert np.isfinite(stuck).mean() == pytest.approx(0.2, abs=0.02)
    assert np.nanmin(stuck) >= 0.0
    assert np.nanmax(stuck) < 12.0
