"""The whole controller in a closed loop, against boxes it knows only from the costmap."""

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import make_setup
from controller_scenes import observe as observe_plan
from teb_closed_loop import drive, plan_from_elements, window

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.teb import TimedElasticBand
from drake_navbench.controllers.teb import choice as choice_module
from drake_navbench.controllers.teb import program as program_module
from drake_navbench.controllers.teb.memory import REVISIT_PERIOD_S, Alternative, TebMemory
from drake_navbench.controllers.teb.planner import ACCEPTED_VIOLATION
from drake_navbench.inputs.presets import load_preset

STRAIGHT = plan_from_elements([("s", 4.5)])
# Ends a metre behind what stands at 2 m.
SHORT = plan_from_elements([("s", 3.4)])
PRESET = load_preset("teb").parameters
WALL_X = 2.0
WALL = [(WALL_X, -5.0, WALL_X + 0.15, 5.0)]
FRONT_M = 0.85


def make(*, wants_diagnostics=False, **changes):
    setup = make_setup(wants_diagnostics=wants_diagnostics)
    return TimedElasticBand(PRESET.model_copy(update=changes), setup)


def observe(pose, boxes=(), *, plan=STRAIGHT, **values):
    near = plan[np.hypot(*(plan[:, :2] - pose[:2]).T) < 2.5]
    costmap = window(boxes, pose[0], pose[1])
    return observe_plan(near, pose=pose, costmap=costmap, goal=plan[-1], **values)


def test_free_run_reaches_the_goal_at_the_speed_and_acceleration_limits():
    record = drive(make(), plan_from_elements([("s", 3.0)]), [], duration_s=20.0)
    assert record.outcome == "succeeded"
    speeds = np.array(record.commands)[:, 0]
    assert speeds.max() <= 0.5
    assert np.median(speeds) > 0.48
    # To 0.5 m/s over 0.25 m in 1 s, then cruising to within 0.25 m: 1 s + (2.75 - 0.25) / 0.5 s.
    assert record.times_s[-1] == pytest.approx(6.0, abs=0.4)
    assert np.abs(np.array(record.poses)[:, 1]).max() < 0.01
    assert all(d["violation"] <= ACCEPTED_VIOLATION for d in record.diagnostics)


@pytest.mark.parametrize(
    ("plan", "boxes"),
    [
        ([("s", 1.0), ("a", 90.0, 0.6), ("s", 1.0)], []),
        pytest.param([("s", 3.4)], [(2.0, -0.2, 2.4, 0.6)], marks=pytest.mark.long),
    ],
)
def test_accelerations_hold_from_command_to_command(plan, boxes):
    # The base lags behind its commands, and the pose is seen with noise.
    noise = (np.random.default_rng(2), 0.005)
    record = drive(make(), plan_from_elements(plan), boxes, duration_s=20.0, noise=noise)
    assert record.outcome == "succeeded"
    changes = np.abs(np.diff(np.vstack([[0.0, 0.0], record.commands]), axis=0))
    limits = 0.05 * np.array([PRESET.acc_lim_x, PRESET.acc_lim_theta])
    assert np.all(changes <= limits + 1e-12)
    # They are used: it sets off and turns as fast as it may.
    assert changes[0, 0] > 0.9 * limits[0]


def test_a_base_that_does_not_follow_is_planned_for_as_it_moves():
    controller = make()
    memory = controller.step(observe((0, 0, 0), twist=(0.5, 0)), TebMemory()).memory
    stuck = controller.step(observe((0, 0, 0), twist=(0.0, 0), time_s=0.05), memory)
    assert stuck.command[0] <= 0.05 * PRESET.acc_lim_x + 1e-12


def test_a_car_turns_no_sharper_than_it_can_and_not_on_the_spot():
    radius = 0.8
    plan = plan_from_elements([("s", 0.6), ("a", 90.0, 0.5), ("s", 0.8)])
    record = drive(make(min_turning_radius=radius), plan, [], duration_s=20.0)
    assert record.outcome == "succeeded"
    speeds, rates = np.array(record.commands).T
    assert np.all(np.abs(rates) <= np.abs(speeds) / radius + 1e-9)
    assert np.abs(rates).max() > 0.3


def test_other_ways_are_looked_for_where_the_plans_way_is_narrow():
    # A gap 0.94 m wide between two boxes, 0.17 m on either side of the robot.
    gap = [(1.6, 0.47, 2.0, 0.6), (1.6, -0.6, 2.0, -0.47)]
    narrow = make().step(observe((0, 0, 0), gap), TebMemory())
    assert narrow.diagnostics["candidate_count"] > 1
    alone = make(enable_homotopy_class_planning=False).step(observe((0, 0, 0), gap), TebMemory())
    assert alone.diagnostics["candidate_count"] == 1
    wide = [(1.6, 0.7, 2.0, 0.9), (1.6, -0.9, 2.0, -0.7)]
    assert make().step(observe((0, 0, 0), wide), TebMemory()).diagnostics["candidate_count"] == 1


def test_the_plans_door_is_taken_and_not_a_way_around_the_whole_wall():
    # 0.9 m wide, 0.15 m on either side of the robot; around the wall it is more than twice as far.
    wall = [(2.0, 0.45, 2.1, 2.0), (2.0, -2.0, 2.1, -0.45)]
    record = drive(make(), SHORT, wall, duration_s=15.0, start=(0.4, 0.0, 0.0))
    assert record.outcome == "succeeded"
    assert np.abs(np.array(record.poses)[:, 1]).max() < 0.2


def test_a_gap_that_the_plan_leads_through_has_obstacles_on_either_side():
    # As narrow as 0.075 m on either side: its posts are two obstacles, or the ways past both of
    # them and through between would be of one class.
    gap = [(1.6, 0.375, 2.0, 0.9), (1.6, -0.9, 2.0, -0.375)]
    controller = make(wants_diagnostics=True)
    decision = controller.step(observe((0, 0, 0), gap), TebMemory())
    assert len(decision.diagnostics["sampled_classes"].split("; ")[0].split(" ")) == 2


def test_a_single_cell_on_the_line_is_passed():
    record = drive(
        make(), SHORT, [(2.0, -0.03, 2.04, 0.03)], duration_s=20.0, start=(0.4, 0.0, 0.0)
    )
    assert record.outcome == "succeeded"


@pytest.mark.parametrize("side", [1.0, pytest.param(-1.0, marks=pytest.mark.long)])
def test_a_box_on_the_plan_is_passed_on_its_shorter_side(side):
    low, high = sorted([side * -0.2, side * 0.6])
    record = drive(make(), SHORT, [(2.0, low, 2.4, high)], duration_s=20.0, start=(0.4, 0.0, 0.0))
    assert record.outcome == "succeeded"
    lateral = np.array(record.poses)[:, 1]
    assert (side * lateral).min() < -0.4
    assert (side * lateral).max() < 0.1


def test_a_wall_across_the_plan_ends_in_no_valid_control_and_never_in_a_collision():
    record = drive(make(), STRAIGHT, WALL, duration_s=15.0, start=(0.5, 0.0, 0.0))
    assert record.outcome == "NoValidControl"
    nearest = np.array(record.poses)[:, 0].max() + FRONT_M
    assert WALL_X - nearest > 0.5 * PRESET.min_obstacle_dist
    assert "min_obstacle_dist" in record.message


def test_a_patient_server_does_not_make_it_touch_the_wall():
    start = (0.6, 0.0, 0.0)
    record = drive(make(), STRAIGHT, WALL, duration_s=5.0, start=start, failures_allowed=10_000)
    assert record.outcome == "timed_out"


def test_the_band_switches_sides_only_for_a_shorter_way():
    # The box is nearly in the middle and the robot now left, now right of the plan.
    controller = make(wants_diagnostics=True)
    boxes = [(1.0, -0.32, 1.3, 0.3)]
    memory = controller.initial_memory()
    sides = []
    for step in range(6):
        lateral = 0.02 * (-1.0) ** step
        decision = controller.step(observe((0.0, lateral, 0.0), boxes, time_s=0.05 * step), memory)
        memory = decision.memory
        band = decision.diagnostics["predicted_trajectory"]
        sides.append(math.copysign(1.0, band[np.argmax(np.abs(band[:, 1])), 1]))
    assert len(set(sides)) == 1


def test_a_band_on_the_wrong_side_is_left_for_a_much_shorter_way():
    controller = make(wants_diagnostics=True)
    detour = np.array([[0, 0, 0], [0.8, 1.6, 0.5], [2.2, 1.6, -0.5], [2.5, 0, 0.0]])
    wrong = controller.step(
        observe((0.0, 0.0, 0.0), [(1.2, -0.9, 1.6, 0.5)], plan=_dense(detour)), TebMemory()
    ).memory
    free = [(1.2, 0.35, 1.6, 1.2)]
    memory = wrong
    for step in range(8):
        decision = controller.step(observe((0, 0, 0), free, time_s=0.05 * step), memory)
        memory = decision.memory
    # The plan runs straight, below the box that is there now.
    assert decision.diagnostics["predicted_trajectory"][:, 1].max() < 0.35


def with_a_lost_alternative(controller, observation):
    """Returns a memory in which a band past the other side of a box was optimised and lost."""
    memory = controller.step(observation, TebMemory()).memory
    if not memory.alternatives[0].accepted:
        memory = controller.step(observation, memory).memory
    assert memory.alternatives[0].accepted
    return memory


def test_a_band_that_lost_is_kept_and_optimised_again_only_after_a_while():
    controller = make()
    box = observe((0, 0, 0), [(1.0, -0.32, 1.3, 0.3)])
    memory = with_a_lost_alternative(controller, box)
    (lost,) = memory.alternatives
    soon = controller.step(replace(box, time_s=0.5 * REVISIT_PERIOD_S), memory)
    assert soon.diagnostics["candidate_count"] == 1
    assert soon.memory.alternatives == (lost,)
    due = controller.step(replace(box, time_s=REVISIT_PERIOD_S), soon.memory)
    assert due.diagnostics["candidate_count"] == 2
    assert due.memory.alternatives[0].stamp_s == REVISIT_PERIOD_S


def test_a_band_that_lost_is_optimised_at_once_where_the_driven_one_breaks_a_limit(monkeypatch):
    controller = make()
    box = observe((0, 0, 0), [(1.0, -0.32, 1.3, 0.3)])
    memory = with_a_lost_alternative(controller, box)
    unconfirmed = program_module.BandProgram.unconfirmed
    violations = iter([1.0])

    def driven_one_fails(self, newton):
        solution = unconfirmed(self, newton)
        return solution._replace(violation=next(violations, solution.violation))

    monkeypatch.setattr(program_module.BandProgram, "unconfirmed", driven_one_fails)
    decision = controller.step(replace(box, time_s=0.05), memory)
    assert decision.diagnostics["candidate_count"] == 2
    assert not decision.diagnostics["is_fallback"]
    was, now = memory.band.poses[:, 1].sum(), decision.memory.band.poses[:, 1].sum()
    assert was * now < 0.0


def watched(monkeypatch, name):
    """Returns the list that a call of a method of the programs adds to."""
    calls = []
    method = getattr(program_module.BandProgram, name)

    def wrapped(self, *args, **kwargs):
        calls.append(name)
        return method(self, *args, **kwargs)

    monkeypatch.setattr(program_module.BandProgram, name, wrapped)
    return calls


def test_ipopt_confirms_the_band_that_is_driven_and_no_other(monkeypatch):
    box = observe((0, 0, 0), [(1.0, -0.32, 1.3, 0.3)])
    confirmed = watched(monkeypatch, "confirm")
    assert make().step(box, TebMemory()).diagnostics["candidate_count"] == 2
    assert len(confirmed) == 1
    confirmed.clear()
    make(solver="interior_point").step(box, TebMemory())
    assert not confirmed


def without_bands(monkeypatch):
    """Lets Newton's method and IPOPT fail at every guess."""
    for name in ("unconfirmed", "confirm"):
        method = getattr(program_module.BandProgram, name)
        monkeypatch.setattr(program_module.BandProgram, name, _without_a_feasible_iterate(method))


def test_a_class_that_failed_is_tried_again_only_after_a_while(monkeypatch):
    # Two ways past the box fail while the band driven so far goes on.
    controller = make()
    box = [(1.6, -0.32, 1.9, 0.3)]
    memory = controller.step(observe((0, 0, 0), box), TebMemory()).memory
    memory = memory._replace(alternatives=())
    without_bands(monkeypatch)
    runs = watched(monkeypatch, "run_newton")
    counts = []
    for time_s in (0.05, 0.1, 0.05 + REVISIT_PERIOD_S):
        runs.clear()
        decision = controller.step(observe((0, 0, 0), box, time_s=time_s), memory)
        memory = decision.memory
        assert decision.diagnostics["is_fallback"]
        counts.append(len(runs))
    assert counts[1] < counts[0]
    assert counts[2] == counts[0]


def test_what_takes_long_takes_several_cycles(monkeypatch):
    monkeypatch.setattr(choice_module, "ENOUGH_WORK", 0)
    controller = make()
    box = [(1.0, -0.32, 1.3, 0.3)]
    first = controller.step(observe((0, 0, 0), box), TebMemory())
    assert first.diagnostics["candidate_count"] == 1
    (waiting,) = first.memory.alternatives
    assert waiting.is_queued
    # Its turn comes where the band driven so far does not use up the time, and no later than that.
    monkeypatch.setattr(choice_module, "ENOUGH_WORK", 1000)
    second = controller.step(observe((0, 0, 0), box, time_s=0.05), first.memory)
    assert second.diagnostics["candidate_count"] == 2
    assert not any(other.is_queued for other in second.memory.alternatives)


def test_what_was_put_off_is_tried_before_the_robot_gives_up(monkeypatch):
    controller = make()
    box = [(1.6, -0.32, 1.9, 0.3)]
    good = controller.step(observe((0, 0, 0), box), TebMemory())
    failed = [
        Alternative(good.memory.band, 0.0, accepted=False),
        *(other._replace(accepted=False) for other in good.memory.alternatives),
    ]
    memory = TebMemory(alternatives=tuple(failed))
    runs = watched(monkeypatch, "run_newton")
    again = controller.step(observe((0, 0, 0), box, time_s=0.05), memory)
    assert runs
    np.testing.assert_allclose(again.command, good.command, atol=1e-6)


def test_a_new_guess_stands_in_for_a_band_that_no_longer_obeys_the_limits():
    # The band goes around a box that is gone, and the plan straight on: of one class now.
    controller = make(wants_diagnostics=True)
    detour = _dense(np.array([[0, 0, 0], [0.8, 1.6, 0.5], [2.2, 1.6, -0.5], [2.5, 0, 0.0]]))
    first = controller.step(
        observe((0.0, 0.0, 0.0), [(1.2, -0.9, 1.6, 0.5)], plan=detour), TebMemory()
    )
    free = observe((0, 0, 0), [(1.2, 0.35, 1.6, 1.2)], time_s=0.05)
    second = controller.step(free, first.memory)
    assert not second.diagnostics["is_fallback"]
    assert np.abs(second.diagnostics["predicted_trajectory"][:, 1]).max() < 0.35


def _dense(corners):
    samples = np.linspace(0.0, len(corners) - 1.0, 60)
    return np.column_stack(
        [np.interp(samples, np.arange(len(corners)), corners[:, i]) for i in range(3)]
    )


def test_a_command_is_never_returned_for_a_band_whose_outline_collides():
    # The outline already stands on a lethal cell beside the discs: a corner of the wheelchair.
    corner = [(0.8, 0.25, 0.84, 0.29)]
    with pytest.raises(NoValidControl) as caught:
        make().step(observe((0.0, 0.0, 0.0), corner), TebMemory())
    assert caught.value.memory == TebMemory()
    assert {"solver_status", "violation", "evaluations"} <= set(caught.value.details)


def test_the_last_feasible_band_drives_on_when_the_solver_stops_too_early(monkeypatch):
    controller = make()
    first = controller.step(observe((0, 0, 0), twist=(0.4, 0)), TebMemory())
    without_bands(monkeypatch)
    second = controller.step(observe((0.02, 0, 0), twist=(0.4, 0), time_s=0.05), first.memory)
    assert second.diagnostics["is_fallback"]
    assert second.diagnostics["solver_status"] == "kIterationLimit"
    # What is left of the first band is driven as planned: on up to full speed.
    assert first.command[0] < second.command[0] < first.command[0] + 0.05 * PRESET.acc_lim_x
    rest = first.memory.band.time_steps[0] - 0.05
    assert second.memory.band.time_steps[0] == pytest.approx(rest)


def _without_a_feasible_iterate(method):
    def wrapped(self, *args):
        solution = method(self, *args)
        return solution._replace(violation=1.0, status="kIterationLimit")

    return wrapped


def test_speed_limits_hold():
    observation = replace(observe((0, 0, 0), twist=(0.2, 0)), speed_limit=SpeedLimit(0.2))
    command = make().step(observation, TebMemory()).command
    assert 0.15 < command[0] <= 0.2


def test_diagnostics_hold_the_band_with_its_times_and_the_candidates_with_their_classes():
    controller = make(wants_diagnostics=True)
    box = observe((0, 0, 0), [(1.0, -0.3, 1.2, 0.3)])
    diagnostics = controller.step(box, TebMemory()).diagnostics
    poses = diagnostics["predicted_trajectory"]
    assert poses.shape == (diagnostics["interval_count"] + 1, 3)
    assert diagnostics["predicted_times_s"].shape == (len(poses),)
    count = diagnostics["candidate_count"]
    assert diagnostics["sampled_trajectories"].shape[0] == count == 2
    assert diagnostics["sampled_trajectories"].shape[1] >= len(poses)
    assert diagnostics["sampled_costs"].shape == (count,)
    assert len(diagnostics["sampled_classes"].split("; ")) == count
    scalars = {"solver_status", "evaluations", "slack_m", "violation", "is_blocked", "is_fallback"}
    assert scalars <= set(make().step(box, TebMemory()).diagnostics)


def test_a_goal_behind_the_robot_is_reached_by_turning():
    plan = plan_from_elements([("s", 1.2)])
    record = drive(make(), plan, [], duration_s=25.0, start=(0.0, 0.0, 3.0))
    assert record.outcome == "succeeded"
