"""MPPI: Nav2's sampling controller, and a nonlinear program that polishes its result."""

from drake_navbench.controllers.mppi.controller import ModelPredictivePathIntegral
from drake_navbench.controllers.mppi.parameters import MppiParameters

__all__ = ["ModelPredictivePathIntegral", "MppiParameters"]
