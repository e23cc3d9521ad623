"""The contract of a smoother of plans: its inputs, its result, and its errors."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.planner import PlanningError
from drake_navbench.typed_files.typed_yaml import FrozenModel


class SmoothingError(PlanningError):
    """The planner found a path, but its smoother failed; `code` is Nav2's SmoothPath error code."""

    code = 504


class SmootherParameters(FrozenModel):
    """Base of the parameters of a smoother that is not built in: unknown names refused, frozen.

    type: under which name it is registered, as the scenario gives it.
    """

    type: str = Field(
        "", description="Type of the smoother: the name under which it is registered."
    )


class Smoother(Protocol):
    """Smooths plans; pure: the same plan on the same costmap gives the same path, bit for bit."""

    def smooth(self, path: NDArray[np.float64], costmap: Costmap) -> NDArray[np.float64]:
        """Returns the smoothed path (M, 3) x m, y m, yaw rad of a planner's path (N, 3).

        Raises SmoothingError where it cannot.
        """
        ...
