"""Graceful Controller, as in nav2_graceful_controller: a smooth control law to a pose ahead."""

from drake_navbench.controllers.graceful.controller import Graceful
from drake_navbench.controllers.graceful.parameters import GracefulParameters

__all__ = ["Graceful", "GracefulParameters"]
