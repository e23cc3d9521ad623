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


class NoiseKey(NamedTuple):
    """Names one step's random numbers: equal keys give equal numbers, on any machine."""

    seed: int
    stream: int
    step: int

    def generator(self) -> np.random.Generator:
        """Returns a fresh generator that depends on the key alone."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(self.stream, self.step))
        return np.random.Generator(np.random.PCG64(sequence))


NO_NOISE = NoiseKey(seed=0, stream=0, step=0)
