"""A controller that is a System of Drake: a LeafSystem or a Diagram computes the command."""

from drake_navbench.controllers.drake_system.controller import SystemController

__all__ = ["SystemController"]
