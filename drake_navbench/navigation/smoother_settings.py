"""The smoother of a scenario's plan: chosen by name, with its parameters."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation import savitzky_golay_smoother, simple_smoother
from drake_navbench.navigation.smoother import Smoother, SmootherParameters, SmoothingError
from drake_navbench.navigation.smoother_parameters import (
    ConstrainedSmootherParameters,
    SavitzkyGolaySmootherParameters,
    SimpleSmootherParameters,
)
from drake_navbench.plugins.choice import plugin_choice
from drake_navbench.plugins.kinds import PluginKind

Array = NDArray[np.float64]


class SimpleSmoothing(SimpleSmootherParameters):
    """Nav2's simple smoother."""

    type: Literal["simple"]


class ConstrainedSmoothing(ConstrainedSmootherParameters):
    """Nav2's constrained smoother."""

    type: Literal["constrained"]


class SavitzkyGolaySmoothing(SavitzkyGolaySmootherParameters):
    """Nav2's Savitzky-Golay smoother."""

    type: Literal["savitzky_golay"]


class SimpleSmoother:
    """Nav2's simple smoother."""

    Parameters = SimpleSmoothing

    def __init__(self, parameters: SimpleSmoothing) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad."""
        return simple_smoother.smooth_path(path, costmap, self._parameters)


class ConstrainedSmoother:
    """Nav2's constrained smoother."""

    Parameters = ConstrainedSmoothing

    def __init__(self, parameters: ConstrainedSmoothing) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (M, 3) x m, y m, yaw rad; raises SmoothingError."""
        # Imported late: Drake's solvers take a while, and a list of scenarios solves nothing.
        from drake_navbench.navigation import constrained_smoother

        try:
            return constrained_smoother.smooth_path(path, costmap, self._parameters)
        except constrained_smoother.FailedToSmoothPath as error:
            raise SmoothingError(str(error)) from error


class SavitzkyGolaySmoother:
    """Nav2's Savitzky-Golay smoother."""

    Parameters = SavitzkyGolaySmoothing

    def __init__(self, parameters: SavitzkyGolaySmoothing) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (N, 3) x m, y m, yaw rad; looks at no costmap."""
        return savitzky_golay_smoother.smooth_path(path, self._parameters)


SMOOTHERS = PluginKind(
    noun="smoother",
    group="drake_navbench.smoothers",
    members=("Parameters", "smooth"),
    guide="docs/plugins.md",
    parameters=SmootherParameters,
    built_in={
        "simple": SimpleSmoother,
        "constrained": ConstrainedSmoother,
        "savitzky_golay": SavitzkyGolaySmoother,
    },
)
"""The smoothers by the names that a scenario gives them."""

SmootherSettings = plugin_choice(SMOOTHERS, key="type")
"""Parameters of the smoother that `type` names."""


def make_smoother(settings: Any) -> Smoother:
    """Returns the smoother that settings choose; raises InputError where it cannot be made."""
    return SMOOTHERS.make(settings.type, settings)
