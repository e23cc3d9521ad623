"""Vector Pursuit, as in vector_pursuit_controller: pursues a pose, not only a point."""

from drake_navbench.controllers.vector_pursuit.controller import VectorPursuit
from drake_navbench.controllers.vector_pursuit.parameters import VectorPursuitParameters

__all__ = ["VectorPursuit", "VectorPursuitParameters"]
