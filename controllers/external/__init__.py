"""A controller in a process of its own, in any language; see docs/external_controllers.md."""

from drake_navbench.controllers.external.controller import ExternalController

__all__ = ["ExternalController"]
