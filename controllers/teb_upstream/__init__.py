"""The original TEB: teb_local_planner's penalties under Levenberg and Marquardt's method."""

from __future__ import annotations

from drake_navbench.controllers.teb_upstream.controller import UpstreamTimedElasticBand

__all__ = ["UpstreamTimedElasticBand"]
