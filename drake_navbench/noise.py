"""Random numbers as a pure function of (seed, stream, step).

No generator is kept anywhere, so adding a noise source or a controller never shifts the numbers
of another, and a Context can be cloned and replayed.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class NoiseStream(IntEnum):
    """The independent sources of randomness in a trial."""

    START_POSE = 1
    LOCALIZATION = 2
    LIDAR = 3
    CONTROLLER = 4


# Philox is a counter-based generator with a key of 128 bits: 64 for the seed, 32 each for the rest.
STREAM_SHIFT = 64
STEP_SHIFT = 96


class NoiseKey(NamedTuple):
    """Names one step's random numbers: equal keys give equal numbers, on any machine.

    seed: below 2**64. stream, step: below 2**32, none negative.
    """

    seed: int
    stream: int
    step: int

    def generator(self) -> np.random.Generator:
        """Returns a fresh generator that depends on the key alone."""
        key = self.seed | self.stream << STREAM_SHIFT | self.step << STEP_SHIFT
        return np.random.Generator(np.random.Philox(key=key))


NO_NOISE = NoiseKey(seed=0, stream=0, step=0)
