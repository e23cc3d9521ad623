"""Smoothers of plans: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from typing import Any

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.smoother import Smoother, SmoothingError
from drake_navbench.navigation.smoother_parameters import ConstrainedSmootherParameters
from drake_navbench.navigation.smoothers import SavitzkyGolaySmoother, SimpleSmoother
from drake_navbench.plugins.choice import plugin_choice
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginParameters


class ConstrainedSmoother:
    """Nav2's constrained smoother."""

    nav2_plugin = "nav2_constrained_smoother::ConstrainedSmoother"
    Parameters = ConstrainedSmootherParameters

    def __init__(self, parameters: ConstrainedSmootherParameters) -> None:
        self._parameters = parameters

    def smooth(self, path: Array, costmap: Costmap) -> Array:
        """Returns the smoothed path (M, 3) x m, y m, yaw rad; raises SmoothingError."""
        # Imported late: Drake's solvers take a while, and a list of scenarios solves nothing.
        from drake_navbench.navigation import constrained_smoother

        try:
            return constrained_smoother.smooth_path(path, costmap, self._parameters)
        except constrained_smoother.FailedToSmoothPath as error:
            raise SmoothingError(str(error)) from error


SMOOTHERS = PluginKind(
    noun="smoother",
    group="drake_navbench.smoothers",
    members=("Parameters", "smooth"),
    guide="docs/plugins.md",
    parameters=PluginParameters,
    built_in={
        smoother.nav2_plugin: smoother
        for smoother in (SimpleSmoother, ConstrainedSmoother, SavitzkyGolaySmoother)
    },
)
"""The smoothers by Nav2's plugin type."""

SmootherSettings = plugin_choice(SMOOTHERS, SimpleSmoother.nav2_plugin)
"""Parameters of a smoother; without `plugin`, of the SimpleSmoother."""


def make_smoother(settings: Any) -> Smoother:
    """Returns the smoother that settings choose; raises InputError where it cannot be made."""
    return SMOOTHERS.make(settings.plugin, settings)
