"""Parity of a port and the original controller in a build: in random scenes and in whole trials.

A trial is driven twice. In the first run the port drives, and the original decides in every cycle
beside it, from the same observations. In the second run the original drives: a small difference
changes the next observations and can grow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.controller import (
    Controller,
    ControllerError,
    ControllerParameters,
    Observation,
)
from drake_navbench.controllers.external.client_process import (
    ClientProcess,
    ExternalControllerFailed,
)
from drake_navbench.controllers.external.messages import configure_message
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset, load_preset, original_plugin
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.native.builds import Build
from drake_navbench.plugins.releases import RELEASE_FIELD
from drake_navbench.studies.side_by_side.gate import column_of, split_column
from drake_navbench.studies.side_by_side.likeness import CLOSE, Likeness, likeness_of
from drake_navbench.studies.side_by_side.shadowing import Decided, decided, shadowed
from drake_navbench.trial.column_controller import built_controller, controller_setup
from drake_navbench.trial.random_scenes import random_scenes
from drake_navbench.trial.trial import DEFAULT_ROBOT, run_trial
from drake_navbench.typed_files.dotted_names import flattened

# The presets that are held against their originals, in this order.
PORTS = ("rpp", "dwb", "mppi_nav2", "graceful", "rotation_shim", "teb_upstream")
COMMANDS = ("command_v_mps", "command_w_radps")
START_PATIENCE_S = 30.0


class _Crashed(ControllerError):
    """The end of a client in place of its decision, which no decision of a port equals."""


class DecisionResult(NamedTuple):
    """Two decisions of equal observations: of a random scene, or of a trial's cycle.

    difference: the larger one of |dv| m/s and |dw| rad/s; NaN where one has failed. told: both
    decisions in words, where they differ.
    """

    likeness: Likeness
    difference: float
    told: str


class TrialResult(NamedTuple):
    """A trial that the port drives, and the same one that the original drives by itself.

    cycles: in each cycle of the port's trial the commands of both on the same observation.
    difference: the largest difference of the commands of the two trials at one time. apart_s: the
    time at which these first differ by more than 1e-5; NaN where they never do. outcomes: of the
    port's trial and of the original's.
    """

    scenario: str
    seed: int
    cycles: tuple[DecisionResult, ...]
    likeness: Likeness
    difference: float
    apart_s: float
    outcomes: tuple[str, str]


class OtherDefault(NamedTuple):
    """A parameter that is not given and has different defaults in port and original."""

    name: str
    of_port: Any
    of_original: Any


class Parity(NamedTuple):
    """A port and its original, with equal parameters given."""

    preset: str
    plugin: str
    scenes: tuple[DecisionResult, ...]
    trials: tuple[TrialResult, ...]
    defaults: tuple[OtherDefault, ...]
    not_read: tuple[str, ...]


def ports_in(build: Build) -> list[str]:
    """Returns the presets whose originals a build has."""
    return [name for name in PORTS if original_plugin(name) in build.controllers]


def compare_port(
    name: str,
    build: Build,
    *,
    scenes: int,
    scenarios: Sequence[str],
    seeds: int,
    tell: Callable[[str], None] = lambda line: None,
) -> Parity:
    """Returns the differences of a preset's port and its original in a build; raises InputError."""
    port, original = port_of_release(name, build), load_preset(column_of(name, build))
    robot = load_robot(DEFAULT_ROBOT)
    plugin = original_plugin(split_column(name)[0])
    if plugin is None:
        raise InputError(f"controller {name!r}: it is not a port of a Nav2 controller")
    defaults, not_read = _told_by(original, port, robot)
    tell(f"{name}: {scenes} scenes")
    in_scenes = compare_in_scenes(port, original, robot, scenes)
    in_trials = []
    for scenario in scenarios:
        for seed in range(seeds):
            tell(f"{name}: {scenario}, seed {seed}")
            in_trials.append(compare_in_trial(port, original, scenario, seed, DEFAULT_ROBOT))
    return Parity(name, plugin, tuple(in_scenes), tuple(in_trials), defaults, not_read)


def port_of_release(name: str, build: Build) -> Preset:
    """Returns a preset with the rules of a build's release, if its port has `nav2_release`."""
    preset = load_preset(name)
    if RELEASE_FIELD not in preset.controller_class.Parameters.model_fields:
        return preset
    return load_preset(f"{name}:{RELEASE_FIELD}={build.release}")


def compare_in_scenes(
    port: Preset, original: Preset, robot: Robot, count: int
) -> list[DecisionResult]:
    """Returns the compared decisions of two columns in the first cycle of random scenes."""
    results = []
    for scene in random_scenes(controller_setup(robot), count):
        decisions = []
        for preset in (port, original):
            # Both controllers are new in every scene: an original may keep a memory beyond a task.
            with built_controller(preset, preset.robot(robot)) as controller:
                decisions.append(_decided_in(scene, controller))
        results.append(_compare_decisions(*decisions))
    return results


def _decided_in(scene: Observation, controller: Controller) -> Decided:
    """Returns the first decision, or the reason for its absence, such as a crash or a hang."""
    try:
        return decided(controller, scene, controller.initial_memory())[0]
    except ExternalControllerFailed as error:
        return _Crashed(str(error).splitlines()[0])


def compare_in_trial(
    port: Preset, original: Preset, scenario: str | Scenario, seed: int, robot_name: str
) -> TrialResult:
    """Returns the compared decisions of two columns in a trial that `port` drives.

    The result also compares this trial with one that `original` drives.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    robot = scenario.load_robot(robot_name)
    port, original = port.for_robot(robot), original.for_robot(robot)
    cycles: list[DecisionResult] = []
    both = shadowed(port, original, lambda *pair: cycles.append(_compare_decisions(*pair)))
    logs = [run_trial(scenario, preset, seed, robot=robot) for preset in (both, original)]
    # The cycles of a rehearsal come before those of the trial.
    own = cycles[len(cycles) - int(logs[0].samples["cycle_count"].max()) :]
    return compare_trials(logs[0], logs[1], scenario.name, seed, tuple(own))


def compare_trials(
    port: TrialLog,
    original: TrialLog,
    scenario: str,
    seed: int,
    cycles: tuple[DecisionResult, ...] = (),
) -> TrialResult:
    """Returns the differences of two trials' commands, over the cycles that both have.

    cycles: see TrialResult.
    """
    ours, theirs = (log.samples[list(COMMANDS)].to_numpy() for log in (port, original))
    common = min(len(ours), len(theirs))
    ours, theirs = ours[:common], theirs[:common]
    # A command that only one of the two has is no small difference.
    differences = np.where(np.isnan(ours) & np.isnan(theirs), 0.0, np.abs(ours - theirs))
    differences = np.nan_to_num(differences, nan=math.inf).max(axis=1)
    largest = float(differences.max()) if common else 0.0
    apart = np.flatnonzero(differences > CLOSE)
    times = port.samples["time_s"].to_numpy()
    outcomes = (str(port.outcome), str(original.outcome))
    # Two trials that crash are no proof of anything, however alike they are.
    is_same_end = len(port.samples) == len(original.samples) and outcomes[0] == outcomes[1]
    is_proof = is_same_end and Outcome.ERROR not in outcomes
    likeness = likeness_of(largest) if is_proof else Likeness.DIFFERENT
    apart_s = float(times[apart[0]]) if len(apart) else math.nan
    return TrialResult(scenario, seed, cycles, likeness, largest, apart_s, outcomes)


def _compare_decisions(port: Decided, original: Decided) -> DecisionResult:
    if isinstance(port, ControllerError) or isinstance(original, ControllerError):
        likeness = Likeness.EQUAL if _kind(port) == _kind(original) else Likeness.DIFFERENT
        told = "" if likeness is Likeness.EQUAL else f"port: {port}; original: {original}"
        return DecisionResult(likeness, math.nan, told)
    difference = float(np.abs(port - original).max())
    likeness = likeness_of(difference)
    told = f"port: {port}; original: {original}" if likeness is Likeness.DIFFERENT else ""
    return DecisionResult(likeness, difference, told)


def _kind(decision: Decided) -> tuple[bool, int] | None:
    """Returns whether a client crashed, and the error's code; None for a command."""
    if not isinstance(decision, ControllerError):
        return None
    return isinstance(decision, _Crashed), decision.code


def _told_by(
    original: Preset, port: Preset, robot: Robot
) -> tuple[tuple[OtherDefault, ...], tuple[str, ...]]:
    """Returns the differing defaults, and the given parameters that the original does not read."""
    for_robot, port = original.for_robot(robot), port.for_robot(robot)
    parameters = for_robot.parameters
    words, client = getattr(parameters, "words"), getattr(parameters, "client")  # noqa: B009
    process = ClientProcess(words)
    try:
        message = configure_message(controller_setup(original.robot(robot)), client)
        answer = process.ask(message, deadline_s=START_PATIENCE_S)
    finally:
        process.stop()
    given = {name for name, _ in flattened(client.get("parameters", {}))}
    others = other_defaults(port.parameters, answer.get("defaults", {}), given)
    return others, tuple(map(str, answer.get("not_read", ())))


def other_defaults(
    port: ControllerParameters, defaults: Mapping[str, Any], given: Collection[str]
) -> tuple[OtherDefault, ...]:
    """Returns the original's defaults that differ from those of the port, in its release.

    given: dotted names of the parameters that were given, whose defaults do not matter.
    """
    ours: Mapping[str, Any] = dict(flattened(port.as_read().model_dump(mode="json")))
    return tuple(
        OtherDefault(name, ours[name], default)
        for name, default in defaults.items()
        # None: the port finds its default elsewhere, such as a critic's class by its name.
        if ours.get(name) is not None and name not in given and not _is_same(ours[name], default)
    )


def _is_same(ours: Any, theirs: Any) -> bool:
    if isinstance(ours, int | float) and isinstance(theirs, int | float):
        # Nav2 holds some of its defaults in single precision.
        return math.isclose(ours, theirs, rel_tol=1e-6)
    return bool(ours == theirs)
