"""harmony as a controller: what it refuses, where it gives up, what it tells the replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from harmony_scenes import costmap_with, straight

from drake_navbench import run_trial
from drake_navbench.controller import (
    CollisionAhead,
    ControllerSetup,
    InvalidPath,
    Observation,
    SpeedLimit,
)
from drake_navbench.controllers.harmony import Harmony, HarmonyParameters
from drake_navbench.controllers.harmony.discs import covering_discs
from drake_navbench.controllers.harmony.parameters import stopping_time
from drake_navbench.controllers.harmony.planner import Planner
from drake_navbench.controllers.harmony.prediction import LATENCIES_S
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.footprint import circle_footprint, footprint_radii
from drake_navbench.logs.outcome import Outcome

OUTLINE = np.array([[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]])


def setup_for(outline=OUTLINE, **values):
    inscribed, circumscribed = footprint_radii(outline)
    return ControllerSetup(
        control_period_s=0.05,
        footprint=outline,
        inscribed_radius_m=inscribed,
        circumscribed_radius_m=circumscribed,
        **values,
    )


def seen(*boxes, plan=None, pose=(0.0, 0.0, 0.0), twist=(0.0, 0.0), **values):
    plan = straight(2.0) if plan is None else plan
    return Observation(
        time_s=1.0,
        pose=np.array(pose),
        twist=np.array(twist),
        plan=plan,
        plan_id=1,
        costmap=costmap_with(*boxes),
        goal=np.array([8.0, 0.0, 0.0]),
        **values,
    )


def decide(*boxes, parameters=None, **values):
    controller = Harmony(parameters or HarmonyParameters(), setup_for(wants_diagnostics=True))
    return controller.step(seen(*boxes, **values), controller.initial_memory())


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (
            {"weights.twirling": -0.1},
            "weights.twirling: input should be greater than or equal to 0, got",
        ),
        ({"horizon": 0.7}, "must not be shorter than the stopping time"),
        ({"time_step": 1.0}, "must fit into horizon"),
    ],
)
def test_a_wrong_value_is_told_in_one_line(values, told):
    column = "harmony:" + ":".join(f"{name}={value}" for name, value in values.items())
    with pytest.raises(InputError) as refused:
        load_preset(column).checked()
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_outline_without_an_area_is_told():
    with pytest.raises(ValueError, match="which no disc covers"):
        Harmony(HarmonyParameters(), setup_for(np.array([[0.5, 0.0], [0.0, 0.0], [-0.5, 0.0]])))


def test_a_base_that_cannot_turn_in_place_is_told():
    with pytest.raises(InputError, match="expected one that turns in place"):
        Harmony(HarmonyParameters(), setup_for(min_turning_radius_m=1.0))


def test_the_stopping_time_is_that_of_limited_jerk():
    # 0.5 m/s at 1 m/s^2 with ramps of 0.5 s; and so slow that the acceleration is never reached.
    assert stopping_time(0.5, 1.0, 2.0) == pytest.approx(1.0)
    assert stopping_time(0.5, 2.0, 2.0) == pytest.approx(1.0)


def test_discs_cover_the_outline():
    discs = covering_discs(setup_for())
    # Five parts of 0.224 m: from a middle to the corner of its part, hypot(0.112, 0.31).
    np.testing.assert_allclose(discs[:, 0], [-0.148, 0.076, 0.3, 0.524, 0.748])
    np.testing.assert_allclose(discs[:, 1], np.hypot(0.112, 0.31), rtol=1e-3)


def test_what_the_discs_keep_clear_of_the_corners_keep_clear_of_too():
    discs = covering_discs(setup_for())
    # No corner lies deeper in the discs than on their rim, so that what they keep, it keeps.
    for corner in OUTLINE:
        depth = discs[:, 1] - np.hypot(corner[0] - discs[:, 0], corner[1])
        assert depth.max() == pytest.approx(0.0, abs=2e-3)
    # The default bounds are 5 mm and 25 mm.
    assert Planner(HarmonyParameters(), discs).limits(0.5).clearance > 0.03


def test_a_round_robot_is_one_disc():
    setup = setup_for(circle_footprint(0.3), footprint_is_circle=True)
    np.testing.assert_allclose(covering_discs(setup), [[0.0, 0.3]])


def test_an_empty_plan_is_invalid():
    with pytest.raises(InvalidPath):
        decide(plan=np.empty((0, 3)))


def test_it_gives_up_where_the_map_has_no_way_past():
    closed = (1.25, -3.0, 1.35, 3.0)
    with pytest.raises(CollisionAhead, match="the map has no way past"):
        decide(closed)


def test_it_drives_on_where_there_is_a_way_past():
    assert decide((1.25, -3.0, 1.35, 0.3)).diagnostics["accepted"] == "plan"


def test_it_says_how_far_it_looked_for_a_way_past():
    # A way past begins 2.45 m beside the path; looked for is 1.5 m and the robot's reach, 0.91 m.
    with pytest.raises(CollisionAhead, match=r"has no way past shorter than 4\.8 m$"):
        decide((1.25, -3.0, 1.35, 2.45))


def test_a_blocked_way_far_ahead_is_driven_up_to():
    assert decide((2.0, -3.0, 2.1, 3.0)).command[0] > 0.0


def test_it_brakes_before_it_gives_up():
    # The front is 0.8 m before the wall: 0.2 m until it gives up.
    near, open_way = ((1.85, -3.0, 1.95, 3.0),), ((1.85, 0.9, 1.95, 3.0),)
    plans = [
        decide(*boxes, twist=(0.5, 0.0)).diagnostics["predicted_trajectory"]
        for boxes in (near, open_way)
    ]
    assert plans[0][-1, 0] < 0.5 * plans[1][-1, 0]


def test_a_speed_limit_is_braked_for_within_the_limits():
    limit = SpeedLimit(0.2)
    controller = Harmony(HarmonyParameters(), setup_for())
    first = controller.step(seen(twist=(0.5, 0.0)), controller.initial_memory())
    slower = replace(seen(twist=(0.5, 0.0), speed_limit=limit), time_s=1.05)
    second = controller.step(slower, first.memory)
    assert first.command[0] > second.command[0] > 0.4


def test_the_latency_of_a_base_is_found_from_what_it_does():
    controller = Harmony(HarmonyParameters(), setup_for())
    memory, commands, twist = controller.initial_memory(), [], np.zeros(2)
    for cycle in range(60):
        now = seen(twist=tuple(twist))
        decision = controller.step(replace(now, time_s=0.05 * cycle), memory)
        memory = decision.memory
        commands.append(np.array(decision.command))
        # What was commanded four cycles ago acts now, at first order.
        acting = commands[cycle - 4] if cycle >= 4 else np.zeros(2)
        twist = twist + (acting - twist) * (1.0 - np.exp(-0.5))
    assert LATENCIES_S[memory.sent.latency] == pytest.approx(0.2)


def test_the_replay_is_told_of_guesses_plan_and_stop():
    # The pursuit leads around the box. The stop ends 0.104 m ahead, where the foremost disc, which
    # ends 1.078 m before the axle, is 0.03 m from it: nearer than plans may come.
    shown = decide((1.21, -0.2, 1.31, 0.2), twist=(0.5, 0.0)).diagnostics
    assert shown["predicted_trajectory"].shape == (31, 3)
    assert shown["sampled_trajectories"].shape == (2, 31, 3)
    np.testing.assert_array_equal(np.isfinite(shown["sampled_costs"]), [True, False])
    assert shown["stop_trajectory"].shape[1] == 3


def test_a_trial_through_a_door_succeeds_without_a_contact():
    log = run_trial("doorway", "harmony", seed=1)
    assert log.outcome == Outcome.SUCCEEDED
    assert log.samples["clearance_m"].min() > 0.0
