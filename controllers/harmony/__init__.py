"""harmony: a constrained program and a verified stop plan."""

from drake_navbench.controllers.harmony.controller import Harmony
from drake_navbench.controllers.harmony.parameters import HarmonyParameters

__all__ = ["Harmony", "HarmonyParameters"]
