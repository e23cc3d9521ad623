"""The faults of a scanner, applied to a scan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def burst_dropouts(
    uniform: NDArray[np.float64], share: float, burst_beams: int
) -> NDArray[np.bool_]:
    """Returns (B,) which beams drop out, in bursts of neighbours, `share` of all in the mean.

    uniform: (B,) drawn evenly from 0 to 1, one a beam, counter-clockwise; the last beam's neighbour
    is the first. A burst begins at a beam with the probability q for which a beam stays out of all
    the bursts that may reach it, (1 - q)^burst_beams, with the probability 1 - share.
    """
    length = min(burst_beams, uniform.size)
    begins = uniform < 1.0 - (1.0 - share) ** (1.0 / length)
    counted = np.cumsum(np.concatenate([[False], begins[uniform.size - length + 1 :], begins]))
    return np.asarray(counted[length:] > counted[:-length])


def stuck_ranges(
    generator: np.random.Generator, beam_count: int, share: float, range_max_m: float
) -> NDArray[np.float64]:
    """Returns (B,) the constant range of each stuck beam, m; NaN for a beam that works."""
    is_stuck = generator.random(beam_count) < share
    ranges = range_max_m * generator.random(beam_count)
    return np.where(is_stuck, ranges, np.nan)
