"""The memory layout of a batch: samples in lanes, so that one loop over lanes becomes SIMD code.

A quantity of B samples over N steps is a float32 array (blocks, N, LANES): sample
`block * LANES + lane`, and the lanes of one step lie side by side. The last block is padded with
zeros; its padding is computed like a sample and then ignored. One block of all trajectory
quantities fits into the second-level cache, which is what makes the fused pass fast.

Kernels of one row of lanes are compiled into their callers (`forceinline`): a call makes numba
count references for every array, which takes up to half as long as the row itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Samples of one block. 64 lanes x 56 steps x 6 quantities are 86 kB: above the first-level cache,
# well inside the second, and long enough to make the entry of a vectorised loop cheap.
LANES = 64

Lanes = NDArray[np.float32]


def block_count(batch_size: int) -> int:
    """Returns the number of blocks that hold `batch_size` samples."""
    return -(-batch_size // LANES)


def pack(samples: ArrayLike) -> Lanes:
    """Converts (B, N) samples to (blocks, N, LANES) float32, padded with zeros."""
    rows = np.asarray(samples, dtype=np.float32)
    batch_size, steps = rows.shape
    blocks = block_count(batch_size)
    padded = np.zeros((blocks * LANES, steps), dtype=np.float32)
    padded[:batch_size] = rows
    return np.ascontiguousarray(padded.reshape(blocks, LANES, steps).transpose(0, 2, 1))


def unpack(lanes: Lanes, batch_size: int) -> Lanes:
    """Converts (blocks, N, LANES) back to (B, N) float32; the inverse of `pack`."""
    blocks, steps, width = lanes.shape
    return lanes.transpose(0, 2, 1).reshape(blocks * width, steps)[:batch_size].copy()


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """Makes an array read-only and returns it; its precision stays."""
    array.flags.writeable = False
    return array
