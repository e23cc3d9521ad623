"""A policy that was learned: a small network that drives by the gaps around the robot's outline."""

from drake_navbench.controllers.learned.controller import LearnedPolicy

__all__ = ["LearnedPolicy"]
