"""Newton's method for guesses that it does not converge from: a high barrier first.

If the method starts with the final barrier from a guess that breaks many limits, it can jump
between these limits for ever. A high barrier rounds the corners between them off, and its minimum
is a start for a lower one (Fiacco, McCormick 1968). Where no band obeys the limits the multipliers
grow without bound, which shows before the last stage.
"""

from __future__ import annotations

from typing import NamedTuple

from drake_navbench.controllers.teb.constraints import BandScene
from drake_navbench.controllers.teb.interior_point import (
    Bounds,
    Descent,
    DescentSettings,
    Structure,
    descend,
)
from drake_navbench.controllers.teb.objective import Weights
from drake_navbench.kernels.arrays import Array

# The first barriers, with loose tolerances, as they are only to start from.
STAGES = (
    DescentSettings(barrier=0.1, iterations=20, error_tolerance=1.0, violation_tolerance=1e-2),
    DescentSettings(barrier=0.01, iterations=15, error_tolerance=0.3, violation_tolerance=1e-3),
)
LAST_ITERATIONS = 25
# Larger slopes of the Lagrangian after the stages mean that multipliers grow without bound.
HOPELESS_ERROR = 1e3
# The bound on these slopes half-way through a descent without stages: 99 of 100 descents that
# converge are below it there, and one of three that do not.
UNPROMISING_ERROR = 20.0


class Problem(NamedTuple):
    """A band's program with its number of intervals and its guess (N,)."""

    guess: Array
    interval_count: int
    scene: BandScene
    weights: Weights
    bounds: Bounds
    structure: Structure


def descend_in_stages(problem: Problem, settings: DescentSettings) -> Descent:
    """Returns the result of Newton's method: directly, or else through stages of falling barriers.

    Where no iterations are allowed, there are no stages either.
    """
    straight = descend_from(
        problem, problem.guess, settings._replace(hopeless_error=UNPROMISING_ERROR)
    )
    if straight.converged or settings.iterations == 0:
        return straight
    z, taken = problem.guess, straight.iterations
    for stage in STAGES:
        descent = descend_from(problem, z, stage)
        z, taken = descent.z, taken + descent.iterations
    if descent.error < HOPELESS_ERROR:
        descent = descend_from(problem, z, settings._replace(iterations=LAST_ITERATIONS))
        taken += descent.iterations
    else:
        descent = descent._replace(converged=False)
    return descent._replace(iterations=taken)


def descend_from(problem: Problem, z: Array, settings: DescentSettings) -> Descent:
    """Returns the result of Newton's method from a start z (N,), with one barrier."""
    return descend(
        z,
        problem.interval_count,
        scene=problem.scene,
        weights=problem.weights,
        bounds=problem.bounds,
        structure=problem.structure,
        settings=settings,
    )
