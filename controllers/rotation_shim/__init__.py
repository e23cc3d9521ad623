"""Rotation Shim, as in nav2_rotation_shim_controller: turns in place, then lets another drive."""

from drake_navbench.controllers.rotation_shim.controller import RotationShim
from drake_navbench.controllers.rotation_shim.parameters import RotationShimParameters

__all__ = ["RotationShim", "RotationShimParameters"]
