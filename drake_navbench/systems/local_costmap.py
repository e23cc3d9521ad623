"""The rolling local costmap: obstacle layer and inflation layer around the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_navbench.immutable import Immutable
from drake_navbench.kernels.grid import Costmap


@dataclass(frozen=True, eq=False)
class _LayerState(Immutable):
    """The obstacle layer's own persistent grid, and the costmap made from it."""

    obstacles: NDArray[np.uint8]
    origin: tuple[float, float]
    costmap: Costmap | None
