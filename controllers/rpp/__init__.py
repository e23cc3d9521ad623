"""Regulated Pure Pursuit, as in nav2_regulated_pure_pursuit_controller."""

from drake_navbench.controllers.rpp.controller import RegulatedPurePursuit
from drake_navbench.controllers.rpp.parameters import RegulatedPurePursuitParameters

__all__ = ["RegulatedPurePursuit", "RegulatedPurePursuitParameters"]
