"""DWB, the dynamic window approach with critics, as in nav2_dwb_controller."""

from drake_navbench.controllers.dwb.controller import DynamicWindowApproach
from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters

__all__ = ["DynamicWindowApproach", "DynamicWindowApproachParameters"]
