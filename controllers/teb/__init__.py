"""TEB: the timed elastic band as a constrained program (parameters, controller, program)."""

from __future__ import annotations

from .controller import TimedElasticBand

__all__ = ["TimedElasticBand"]
