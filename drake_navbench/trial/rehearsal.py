"""Rehearses a trial before it counts, so that no measured cycle waits for something to load.

The first use of code in a process takes up to a quarter of a second longer: it reads compiled
kernels, starts a solver, imports modules late. Which code a trial needs depends on the controller,
its parameters, the robot and the scenario, and only driving finds all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from hashlib import sha256

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.trial.spec import TrialSpec

# Long enough for a few control cycles of every robot.
FIRST_CYCLES_S = 0.15
# The time after which the robot is fast enough for the lookahead along the path to find something.
UNDER_WAY_S = 0.75
_UNDER_WAY = {
    "description": "Round a bend beside an obstacle",
    "world": {
        "obstacles": [
            {"type": "box", "min": [1.6, -1.4], "max": [2.0, -0.1]},
            {"type": "box", "min": [-1.0, 1.2], "max": [1.0, 1.4]},
        ]
    },
    "plan": {"type": "polyline", "points": [[0.0, 0.0], [2.2, 0.0], [3.0, 1.5]]},
    "goal": [3.0, 1.5, 1.08],
    "timeout_s": UNDER_WAY_S,
    "name": "rehearsal",
}
_ARRIVING = {
    "description": "Nearly at the goal",
    "plan": {"type": "polyline", "points": [[0.0, 0.0], [0.4, 0.0]]},
    "goal": [0.4, 0.0, 0.5],
    "timeout_s": FIRST_CYCLES_S,
    "name": "rehearsal",
}

_rehearsed: set[str] = set()


def rehearse(spec: TrialSpec, simulate: Callable[[TrialSpec], object]) -> None:
    """Drives a trial's first cycles, and short scenes under way and near a goal, before the trial.

    Each process drives trials that run the same code only once. simulate: drives a specification.
    Errors are ignored here, as the trial itself meets them.
    """
    for scene in _scenes(spec):
        try:
            kind = _kind(scene)
            if kind not in _rehearsed:
                _rehearsed.add(kind)
                simulate(scene)
        except KeyboardInterrupt:
            raise
        except BaseException:
            # Drake reports a failed C++ check as SystemExit, and a plugin may raise anything.
            continue


def _scenes(spec: TrialSpec) -> Iterator[TrialSpec]:
    own = spec.scenario.model_copy(update={"timeout_s": FIRST_CYCLES_S})
    for scenario in (own, *_later_scenes()):
        yield replace(spec, scenario=scenario, seed=0, trial=0, compute_times_ms=None)


@cache
def _later_scenes() -> tuple[Scenario, ...]:
    return Scenario(**_UNDER_WAY), Scenario(**_ARRIVING)


def _kind(spec: TrialSpec) -> str:
    """Returns a digest of all settings that decide which code a specification runs; not the seed.

    No more than a digest is kept of a trial: a process may drive any number of them.
    """
    scenario = spec.scenario
    text = "\n".join(
        (
            scenario.directory,
            scenario.model_dump_json(exclude={"name", "description"}),
            spec.preset.robot(spec.robot).model_dump_json(),
            spec.preset.controller,
            spec.preset.parameters.model_dump_json(),
            str(spec.wants_diagnostics),
        )
    )
    return sha256(text.encode()).hexdigest()
