"""TEB: the timed elastic band as a constrained program (parameters, controller, program)."""

from __future__ import annotations

from drake_navbench.controllers.teb.controller import TimedElasticBand

__all__ = ["TimedElasticBand"]
