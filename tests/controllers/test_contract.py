"""The contract of a controller, for every preset of every registered controller.

A controller is a pure function of observation and memory: finite commands within the base's
limits, inputs untouched, the same again for the same inputs whatever was asked in between, and the
mirrored command in the mirrored world.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from controller_scenes import observe, setup_of
from scenes import straight_plan

from drake_navbench.controller import (
    Controller,
    ControllerError,
    Decision,
    InvalidPath,
    NoiseKey,
    Observation,
)
from drake_navbench.explanation import ExplainingController
from drake_navbench.inputs.presets import load_preset, preset_files
from drake_navbench.kernels.grid import Costmap

# Controllers of which the mirrored world may give another command, and why.
NOT_MIRRORED = {
    "learned": "a network is not symmetric, only what it has learned is nearly",
    "teb_upstream": "draws its roadmap at random, and judges sides from the map's origin",
    "mppi": "samples the same noise in both worlds, so mirrored only on average",
    "vector_pursuit": "counts the angle of its screw to the same side in both, as the original",
}
# By preset, where the controller itself is mirrored.
NOT_MIRRORED_PRESETS = {
    "dwb_tuned": "of its 39 turn rates neighbours often cost the same, and the first one is taken",
}
MIRROR_TOLERANCE = 1e-6
ROUNDING = 1e-9

PERIOD_S = 0.05
RESOLUTION = 0.05
CELLS = 120
INSCRIBED_RADIUS_M = 0.26
INFLATION_RADIUS_M = 0.9
COST_SCALING_FACTOR = 3.0
CYCLES = 4
MIRROR = np.array([1.0, -1.0, -1.0])
COMMAND_MIRROR = np.array([1.0, -1.0, -1.0])

PRESETS = sorted(preset_files())


FOOTPRINT = np.array([[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]])
FOOTPRINT.flags.writeable = False


def make_controller(preset: str, **setup) -> Controller:
    """A preset's controller; one that moves sideways is for a base that can."""
    loaded = load_preset(preset)
    lateral_mps = loaded.parameters.asked_speeds().max_lateral_mps or 0.0
    robot = setup_of(FOOTPRINT, max_lateral_velocity_mps=lateral_mps, **setup)
    return loaded.controller_class(loaded.parameters, robot)


def make_costmap(obstacles=()) -> Costmap:
    """A map from -3 to 3 m with inflated lethal cells; an obstacle is (column, row)."""
    costs = np.zeros((CELLS, CELLS))
    rows, columns = np.indices(costs.shape)
    for column, row in obstacles:
        distance_m = RESOLUTION * np.hypot(columns - column, rows - row)
        inflated = np.floor(
            252.0 * np.exp(-COST_SCALING_FACTOR * (distance_m - INSCRIBED_RADIUS_M))
        )
        inflated[distance_m <= INSCRIBED_RADIUS_M] = 253
        inflated[distance_m > INFLATION_RADIUS_M] = 0
        inflated[row, column] = 254
        costs = np.maximum(costs, inflated)
    half_m = 0.5 * CELLS * RESOLUTION
    return Costmap(costs.astype(np.uint8), -half_m, -half_m, RESOLUTION)


def make_observation(plan, *, pose, twist=(0.0, 0.0), obstacles=(), **values) -> Observation:
    key, costmap = NoiseKey(seed=3, stream=1, step=20), make_costmap(obstacles)
    seen = observe(
        plan, pose=pose, twist=twist, time_s=1.0, costmap=costmap, noise_key=key, **values
    )
    for array in (seen.pose, seen.twist, seen.goal, seen.plan):
        array.flags.writeable = False
    return seen


# Everything lies inside cells, off the lines between them, so that the mirrored world has it in the
# mirrored cells.
PLAN_Y_M = 0.018


def plan_ahead(length_m):
    return straight_plan(length_m, y_m=PLAN_Y_M)


def arc_plan(radius_m=1.5, angle=1.2):
    angles = np.linspace(0.0, angle, 37)
    plan = np.column_stack([np.sin(angles), 1.0 - np.cos(angles), angles / radius_m])
    return radius_m * plan + np.array([0.0, PLAN_Y_M, 0.0])


SITUATIONS = {
    "starting": lambda: make_observation(plan_ahead(2.0), pose=(0.013, 0.013, 0.05)),
    "cruising": lambda: make_observation(
        plan_ahead(2.0), pose=(0.011, 0.062, -0.1), twist=(0.4, 0.1)
    ),
    "in a curve": lambda: make_observation(
        arc_plan(), pose=(0.012, 0.021, 0.02), twist=(0.3, 0.15)
    ),
    "beside an obstacle": lambda: make_observation(
        plan_ahead(2.0),
        pose=(0.012, 0.021, 0.02),
        twist=(0.3, 0.0),
        obstacles=[(84, 78)],
    ),
    "before the goal": lambda: make_observation(
        plan_ahead(0.4), pose=(0.012, 0.021, 0.2), twist=(0.2, 0.0)
    ),
}


def contents(value):
    """What a value is made of, as nested tuples: equal for equal values."""
    if isinstance(value, np.ndarray):
        return (value.shape, value.dtype.str, value.tobytes())
    if isinstance(value, Mapping):
        return tuple((key, contents(value[key])) for key in sorted(value))
    if isinstance(value, (tuple, list)):
        return (type(value).__name__, *(contents(item) for item in value))
    if is_dataclass(value):
        # What is kept under a private name was computed from the rest when somebody asked.
        names = [f.name for f in fields(value) if not f.name.startswith("_")]
        return tuple((name, contents(getattr(value, name))) for name in names)
    return repr(value)


def outcome(controller: Controller, observation: Observation, memory):
    """The decision, or the error that the controller is allowed to raise."""
    try:
        return controller.step(observation, memory)
    except ControllerError as error:
        return error


def outcome_contents(result):
    if isinstance(result, Decision):
        return contents(result)
    return type(result).__name__, str(result), contents(result.details), contents(result.memory)


def advanced(observation: Observation, command) -> Observation:
    """The observation after one period of an exact base that obeys at once."""
    v, w, vy = [*command, 0.0][:3]
    x, y, yaw = observation.pose
    turn = w * PERIOD_S
    chord = v * PERIOD_S * np.sinc(turn / (2.0 * math.pi))
    sideways = vy * PERIOD_S * np.sinc(turn / (2.0 * math.pi))
    direction = yaw + 0.5 * turn
    key = observation.noise_key
    return replace(
        observation,
        time_s=observation.time_s + PERIOD_S,
        pose=np.array(
            [
                x + chord * math.cos(direction) - sideways * math.sin(direction),
                y + chord * math.sin(direction) + sideways * math.cos(direction),
                yaw + turn,
            ]
        ),
        twist=np.array([v, w]),
        vy_mps=vy,
        noise_key=key._replace(step=key.step + 1),
    )


def drive(controller: Controller, observation: Observation):
    """The outcomes of some cycles in closed loop, to the first without a command."""
    memory, results = controller.initial_memory(), []
    for _ in range(CYCLES):
        result = outcome(controller, observation, memory)
        results.append(result)
        if not isinstance(result, Decision):
            break
        memory = result.memory
        observation = advanced(observation, result.command)
    return results


@pytest.fixture(scope="module", params=PRESETS)
def preset(request):
    return request.param


@pytest.fixture(scope="module")
def controller(preset):
    return make_controller(preset)


@pytest.fixture(params=SITUATIONS)
def situation(request):
    return request.param


@pytest.fixture
def observation(situation):
    return SITUATIONS[situation]()


@pytest.fixture(scope="module")
def usual(preset, controller):
    """The outcomes of a preset's controller, by situation; driven once, in this order."""
    return {situation: drive(controller, make()) for situation, make in SITUATIONS.items()}


def all_contents(results):
    return [outcome_contents(result) for result in results]


def test_a_controller_has_what_the_interface_asks_for(controller):
    assert isinstance(controller, Controller)


def test_commands_are_finite_and_within_the_limits_of_the_base(preset, usual, situation):
    lateral_mps = load_preset(preset).parameters.asked_speeds().max_lateral_mps or 0.0
    setup = setup_of(FOOTPRINT)
    results = usual[situation]
    assert isinstance(results[0], Decision), results[0]
    for result in results:
        if isinstance(result, Decision):
            command = np.asarray(result.command)
            assert command.shape == ((3,) if lateral_mps > 0.0 else (2,))
            assert np.abs(command[2:]).max(initial=0.0) <= lateral_mps + ROUNDING
            assert np.isfinite(command).all()
            assert abs(command[0]) <= setup.max_linear_velocity_mps + ROUNDING
            assert abs(command[1]) <= setup.max_angular_velocity_radps + ROUNDING


def test_inputs_stay_as_they_are(controller, observation):
    memory = controller.initial_memory()
    before = contents(observation), contents(memory)
    result = outcome(controller, observation, memory)
    assert (contents(observation), contents(memory)) == before
    memory = getattr(result, "memory", None) or memory
    before = contents(memory)
    outcome(controller, advanced(observation, (0.1, 0.0)), memory)
    assert contents(memory) == before


def test_the_same_inputs_give_the_same_decision_whatever_came_between(controller, usual):
    # In the opposite order, so that others come before each; from the first memory again.
    for situation, results in reversed(usual.items()):
        assert all_contents(drive(controller, SITUATIONS[situation]())) == all_contents(results)


def test_a_fresh_controller_decides_alike(preset, usual, situation, observation):
    fresh = drive(make_controller(preset), observation)
    assert all_contents(fresh) == all_contents(usual[situation])


def test_a_plan_without_poses_is_invalid(controller):
    empty = observe(np.empty((0, 3)), costmap=make_costmap())
    with pytest.raises(InvalidPath, match="poses"):
        controller.step(empty, controller.initial_memory())


@pytest.fixture(scope="module")
def drawing(preset):
    return make_controller(preset, wants_diagnostics=True)


def test_arrays_for_drawing_have_their_shapes(drawing):
    observation = SITUATIONS["beside an obstacle"]()
    diagnostics = outcome(drawing, observation, drawing.initial_memory()).diagnostics
    if "carrot" in diagnostics:
        assert diagnostics["carrot"].shape == (2,)
    if "predicted_trajectory" in diagnostics:
        assert diagnostics["predicted_trajectory"].ndim == 2
        assert diagnostics["predicted_trajectory"].shape[1] == 3
    if "sampled_trajectories" in diagnostics:
        sampled = diagnostics["sampled_trajectories"]
        assert sampled.ndim == 3
        assert sampled.shape[2] == 3
        assert diagnostics["sampled_costs"].shape == sampled.shape[:1]


def test_drawing_does_not_change_the_command(drawing, usual, situation, observation):
    plain, drawn = usual[situation], drive(drawing, observation)
    assert [contents(r.command) for r in plain] == [contents(r.command) for r in drawn]


def test_what_is_explained_is_the_command(preset, controller, drawing, usual, situation):
    if not isinstance(drawing, ExplainingController):
        pytest.skip(f"{preset} cannot tell why")
    memory, observation = controller.initial_memory(), SITUATIONS[situation]()
    for result in usual[situation]:
        command = result.command if isinstance(result, Decision) else None
        before = contents(observation), contents(memory)
        explanation = drawing.explain(observation, memory)
        assert explanation.gives(command), explanation.sentence
        assert explanation.sentence.endswith(".")
        assert {len(row) for row in explanation.rows} <= {len(explanation.columns)}
        assert (contents(observation), contents(memory)) == before
        if command is None:
            break
        memory, observation = result.memory, advanced(observation, command)


def mirrored(observation: Observation) -> Observation:
    costmap = observation.costmap
    return replace(
        observation,
        pose=observation.pose * MIRROR,
        twist=observation.twist * MIRROR[:2],
        vy_mps=-observation.vy_mps,
        plan=np.ascontiguousarray(observation.plan * MIRROR),
        goal=observation.goal * MIRROR,
        costmap=Costmap(
            costmap.costs[::-1], costmap.origin_x, costmap.origin_y, costmap.resolution
        ),
    )


def test_a_mirrored_world_gives_the_mirrored_command(
    preset, controller, usual, situation, observation
):
    name = load_preset(preset).controller
    reason = NOT_MIRRORED.get(name) or NOT_MIRRORED_PRESETS.get(preset)
    if reason:
        pytest.skip(f"{preset}: {reason}")
    here, there = usual[situation], drive(controller, mirrored(observation))
    assert len(here) == len(there)
    for one, other in zip(here, there, strict=True):
        assert type(one) is type(other)
        if isinstance(one, Decision):
            np.testing.assert_allclose(
                other.command,
                one.command * COMMAND_MIRROR[: len(one.command)],
                atol=MIRROR_TOLERANCE,
            )
