"""Every parameter that is said to have an effect has one: another value, other decisions."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from controller_scenes import make_setup, observe
from teb_closed_loop import plan_from_elements, window

from drake_navbench.controller import ControllerError
from drake_navbench.controllers.teb import TimedElasticBand
from drake_navbench.controllers.teb.memory import TebMemory
from drake_navbench.controllers.teb.parameters import DiscModel, TebParameters
from drake_navbench.controllers.teb.program import BandProgram
from drake_navbench.inputs.presets import load_preset

PRESET = load_preset("teb").parameters
BOX = [(1.0, -0.32, 1.3, 0.3)]
GAP = [(1.6, 0.40, 2.0, 0.9), (1.6, -0.9, 2.0, -0.40)]
DEAD_END = [(2.0, -1.5, 2.15, 1.5), (-4.0, 1.4, 2.1, 1.5), (-4.0, -1.5, 2.1, -1.4)]
STRAIGHT = plan_from_elements([("s", 4.5)])
BEND = plan_from_elements([("s", 1.0), ("a", 60.0, 0.7), ("s", 1.5)])


class Scene(NamedTuple):
    """A plan for each cycle, the boxes around, the twist, and the time between cycles, s."""

    plans: tuple = (STRAIGHT,) * 4
    boxes: tuple = ()
    twist: tuple = (0.0, 0.0)
    period_s: float = 0.05


def crosswise(yaw, side=0.0):
    """Returns the straight plan with poses that head elsewhere, moved aside."""
    return STRAIGHT + np.array([0.0, side, yaw])


def way_back():
    return np.column_stack([np.linspace(0.0, -0.5, 11), np.zeros(11), np.zeros(11)])


SCENES = {
    "open": Scene(),
    "bend": Scene(plans=(BEND,) * 3),
    "crosswise": Scene(plans=(crosswise(0.8),) * 2),
    "moved": Scene(plans=(crosswise(0.0), crosswise(0.0, 0.2))),
    "turned": Scene(plans=(crosswise(0.0), crosswise(0.6))),
    "back": Scene(plans=(way_back(),) * 2),
    "aside": Scene(boxes=((1.2, 0.4, 1.6, 0.8),)),
    "box": Scene(boxes=tuple(BOX)),
    "gap": Scene(boxes=tuple(GAP)),
    "dead end": Scene(boxes=tuple(DEAD_END)),
    "slow": Scene(period_s=0.4),
    "slow box": Scene(boxes=tuple(BOX), period_s=0.3),
    "corner": Scene(boxes=((1.62, 0.24, 1.7, 0.6),), twist=(0.5, 0.0)),
}


def decisions(scene, **changes):
    """Returns what a controller with changed parameters does in the cycles of a scene."""
    controller = TimedElasticBand(PRESET.model_copy(update=changes), make_setup())
    memory, told = TebMemory(), []
    for step, plan in enumerate(scene.plans):
        time_s = scene.period_s * step
        observation = observe(
            plan[np.hypot(*plan[:, :2].T) < 2.9],
            time_s=time_s,
            twist=scene.twist,
            plan_id=step,
            costmap=replace(window(scene.boxes, 0.0, 0.0), stamp_s=time_s),
            goal=plan[-1],
        )
        try:
            decision = controller.step(observation, memory)
        except ControllerError as error:
            told.append(str(error))
            memory = error.memory
            continue
        memory = decision.memory
        told += [*decision.command, len(memory.alternatives), decision.diagnostics["evaluations"]]
        told += [] if memory.band is None else [*memory.band.poses.ravel()]
    return told


# Other parameters, in brackets, are what it takes to let the first one matter.
EFFECTS = {
    "dt_ref": (0.2, "open", {}),
    "dt_hysteresis": (0.0, "slow", {}),
    "min_samples": (35, "open", {}),
    "max_samples": (6, "open", {}),
    "global_plan_overwrite_orientation": (False, "crosswise", {}),
    "global_plan_viapoint_sep": (-1.0, "bend", {}),
    "max_global_plan_lookahead_dist": (1.5, "open", {}),
    "force_reinit_new_goal_dist": (0.1, "moved", {}),
    "force_reinit_new_goal_angular": (0.1, "turned", {"global_plan_overwrite_orientation": False}),
    "feasibility_check_no_poses": (-1, "corner", {}),
    "feasibility_check_lookahead_distance": (0.1, "corner", {"feasibility_check_no_poses": -1}),
    "control_look_ahead_poses": (8, "open", {}),
    "max_vel_x": (0.3, "open", {}),
    "max_vel_x_backwards": (0.05, "back", {}),
    "max_vel_theta": (0.3, "bend", {}),
    "acc_lim_x": (0.5, "open", {}),
    "acc_lim_theta": (0.2, "bend", {}),
    "min_turning_radius": (0.9, "bend", {}),
    "footprint_model": (
        PRESET.footprint_model.model_copy(update={"type": "point"}),
        "aside",
        {},
    ),
    "free_goal_vel": (True, "open", {}),
    "min_obstacle_dist": (0.1, "aside", {}),
    "inflation_dist": (1.0, "aside", {}),
    "weight_optimaltime": (3.0, "bend", {}),
    "weight_shortest_path": (1.0, "bend", {}),
    "weight_kinematics_forward_drive": (20.0, "back", {}),
    "weight_inflation": (1.0, "aside", {}),
    "weight_viapoint": (5.0, "bend", {}),
    "enable_homotopy_class_planning": (False, "box", {}),
    "max_number_classes": (1, "box", {}),
    "selection_cost_hysteresis": (5.0, "slow box", {}),
    "selection_prefer_initial_plan": (0.05, "gap", {"min_obstacle_dist": 0.3}),
    "switching_blocking_period": (9.0, "slow box", {"selection_cost_hysteresis": 5.0}),
    "max_ratio_detours_duration_best_duration": (1.0, "box", {}),
    "weight_smoothness": (1.0, "bend", {}),
    "weight_slack": (1.0, "gap", {}),
    "solver": ("interior_point", "bend", {}),
    "blocked_goal_distance_m": (2.0, "dead end", {}),
}
# Of IPOPT's own way, and of obstacles that move: tested here and in test_teb_obstacle_tracking.py.
ELSEWHERE = {
    "no_inner_iterations",
    "no_outer_iterations",
    "cold_start_iterations",
    "include_dynamic_obstacles",
}


@cache
def usual_decisions(scene, *others):
    """Returns the decisions in a scene with the preset's values, but for (name, value) of others.

    Two drives give them, so that it is a value that makes the others.
    """
    first = decisions(SCENES[scene], **dict(others))
    assert decisions(SCENES[scene], **dict(others)) == first
    return first


@pytest.mark.parametrize("name", EFFECTS)
def test_another_value_makes_other_decisions(name):
    value, scene, others = EFFECTS[name]
    assert value != getattr(PRESET, name)
    usual = usual_decisions(scene, *others.items())
    assert decisions(SCENES[scene], **others, **{name: value}) != usual


SHAPES = {
    "point": ({"type": "point"}, {}),
    "circular": ({"type": "circular", "radius": 0.2}, {"radius": 0.35}),
    "two_circles front": ({"type": "two_circles"}, {"front_offset": 0.5}),
    "two_circles front radius": ({"type": "two_circles"}, {"front_radius": 0.35}),
    "two_circles rear": ({"type": "two_circles", "rear_radius": 0.4}, {"rear_offset": -0.3}),
    "two_circles rear radius": ({"type": "two_circles"}, {"rear_radius": 0.4}),
    "line start": (
        {"type": "line", "line_start": (0.0, 0.0), "line_end": (0.5, 0.0)},
        {"line_start": (0.0, 0.3)},
    ),
    "line end": (
        {"type": "line", "line_start": (0.0, 0.0), "line_end": (0.5, 0.0)},
        {"line_end": (0.8, 0.1)},
    ),
    "polygon": (
        {"type": "polygon", "vertices": ((0.5, 0.2), (0.5, -0.2), (-0.1, -0.2), (-0.1, 0.2))},
        {"vertices": ((0.8, 0.3), (0.8, -0.3), (-0.1, -0.3), (-0.1, 0.3))},
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_number_of_a_shape_matters(shape):
    values, change = SHAPES[shape]
    near = SCENES["aside"]._replace(boxes=((0.9, 0.3, 1.3, 0.7), (-0.4, 0.45, 0.1, 0.7)))

    def told(model):
        return decisions(near, footprint_model=DiscModel(**model))

    own = decisions(near)
    assert told(values) != own
    assert not change or told({**values, **change}) != told(values)


def test_no_parameter_is_forgotten():
    assert set(EFFECTS) | ELSEWHERE == set(TebParameters.model_fields)
    assert not TebParameters.WITHOUT_EFFECT & set(TebParameters.model_fields)


@pytest.mark.parametrize(
    ("name", "twist", "wanted"),
    [
        ("no_inner_iterations", (0.5, 0.0), 3 * PRESET.no_outer_iterations),
        ("no_outer_iterations", (0.5, 0.0), 3 * PRESET.no_inner_iterations),
        ("cold_start_iterations", (0.0, 0.0), 3),
    ],
)
def test_ipopts_own_way_is_as_long_as_the_parameters_say(monkeypatch, name, twist, wanted):
    asked = []
    unconfirmed, confirm = BandProgram.unconfirmed, BandProgram.confirm

    def failed(self, newton):
        return unconfirmed(self, newton)._replace(violation=1.0)

    def watched(self, newton, iterations):
        asked.append(iterations)
        return confirm(self, newton, iterations)._replace(violation=1.0)

    monkeypatch.setattr(BandProgram, "unconfirmed", failed)
    monkeypatch.setattr(BandProgram, "confirm", watched)
    decisions(SCENES["open"]._replace(twist=twist, plans=(STRAIGHT,)), **{name: 3})
    assert asked == [wanted]
