"""RotateToGoal, Oscillation, PreferForward, Twirling: judged by command and memory."""

import math

import numpy as np
import pytest
from dwb_cases import SETUP, parameters, scene_of, situate
from hypothesis import given
from hypothesis import strategies as st
from scenes import straight_plan

from drake_navbench.controllers.dwb.critics.oscillation import Oscillation, OscillationMemory, Trend
from drake_navbench.controllers.dwb.critics.preferences import PreferForward, Twirling
from drake_navbench.controllers.dwb.critics.rotate_to_goal import (
    RotateToGoal,
    RotateToGoalMemory,
)


def make(critic_class, **block):
    return critic_class(critic_class.Parameters(**block), parameters(), setup=SETUP)


def score_commands(critic, commands, memory=None):
    """Returns (scores, reasons or None) for commands (vx, vy, wz)."""
    poses = np.zeros((len(commands), 2, 3))
    scores, violations = critic.score(scene_of(poses, velocities=commands), memory)
    if violations is None:
        violations = np.zeros(len(commands), dtype=int)
    reasons = [critic.reasons[code - 1] if code else None for code in violations]
    return scores.tolist(), reasons


def test_twirling_scores_the_yaw_rate():
    scores, _ = score_commands(make(Twirling), [(0.1, 0, -0.5), (0.2, 0, 0.25)])
    assert scores == [0.5, 0.25]


def test_prefer_forward_scores_the_yaw_rate_or_the_penalty():
    commands = [
        (-0.01, 0, 1.0),  # backward: penalty
        (0.09, 0, 0.19),  # creeping: penalty
        (0.09, 0, -0.2),  # turns enough: 10 * 0.2
        (0.1, 0, 0.1),  # moves enough: 10 * 0.1
    ]
    scores, _ = score_commands(make(PreferForward, penalty=7.0), commands)
    assert scores == pytest.approx([7.0, 7.0, 2.0, 1.0])


class TestRotateToGoal:
    critic = make(RotateToGoal)

    def test_flags_latch_as_the_robot_comes_slows_and_is_pushed_away(self):
        # Tolerances 0.25: distance 0.20 at 0.30 m/s, then 0.20 m/s, then 0.60 away at 0.40 m/s.
        flags = []
        memory = self.critic.initial_memory()
        for distance, speed in ((0.2, 0.3), (0.2, 0.2), (0.6, 0.4)):
            situation = situate(
                goal=(distance, 0.0, 0.0), plan=straight_plan(0.5), twist=(speed, 0.0, 0.0)
            )
            memory = self.critic.prepare(situation, memory)
            flags.append(tuple(memory))
        assert flags == [(True, False), (True, True), (True, True)]
        assert self.critic.reset(memory) == (False, False)

    def test_window_needs_a_short_plan_too(self):
        at_the_limit = situate(goal=(0.25, 0.0, 0.0), plan=np.array([[0.0, 0, 0], [1.0, 0, 0]]))
        assert self.critic.prepare(at_the_limit, RotateToGoalMemory()).in_window
        longer = situate(goal=(0.25, 0.0, 0.0), plan=np.array([[0.0, 0, 0], [1.1, 0, 0]]))
        assert not self.critic.prepare(longer, RotateToGoalMemory()).in_window

    @pytest.mark.parametrize("release", ["humble", "iron", "jazzy", "kilted"])
    def test_up_to_kilted_the_plan_may_be_longer(self, release):
        # There it begins up to 2 m behind the robot.
        older = RotateToGoal(
            RotateToGoal.Parameters(), parameters(nav2_release=release), setup=SETUP
        )
        situation = situate(goal=(0.25, 0.0, 0.0), plan=np.array([[-2.0, 0, 0], [0.25, 0, 0]]))
        assert older.prepare(situation, RotateToGoalMemory()).in_window

    def test_far_from_the_goal_everything_goes(self):
        scores, reasons = score_commands(self.critic, [(0.5, 0, 1.0)], RotateToGoalMemory())
        assert (scores, reasons) == ([0.0], [None])

    def test_in_the_window_slower_commands_score_speed_and_yaw_error(self):
        # Measured 0.4 m/s. 0.2 m/s: 5 * 0.04 + |0.3 - (-0.1)| = 0.6. 0.4 m/s does not slow down.
        scene = scene_of(
            [[(0, 0, 0), (0, 0, 0.3)]] * 2,
            velocities=[(0.2, 0, 0), (0.4, 0, 0)],
            twist=(0.4, 0.0, 0.0),
            goal=(0.2, 0.0, -0.1),
        )
        scores, violations = self.critic.score(scene, RotateToGoalMemory(in_window=True))
        assert scores[0] == pytest.approx(0.6, abs=1e-12)
        assert violations.tolist() == [0, 1]
        assert self.critic.reasons[0] == "Not slowing down near goal."

    def test_once_rotating_only_pure_rotation_is_legal(self):
        memory = RotateToGoalMemory(in_window=True, rotating=True)
        commands = [(0.0, 0, 1.0), (1e-16, 0, 1.0), (-0.1, 0, 0), (0, 0.1, 0)]
        _, reasons = score_commands(self.critic, commands, memory)
        assert reasons == [None, *["Nonrotation command near goal."] * 3]

    def test_yaw_error_goes_the_short_way_round(self):
        # From 3 to -3 it is 2 pi - 6.
        scene = scene_of([[(0, 0, 0), (0, 0, 3.0)]], goal=(0.2, 0.0, -3.0))
        scores, _ = self.critic.score(scene, RotateToGoalMemory(True, True))
        assert scores[0] == pytest.approx(2 * math.pi - 6.0, abs=1e-12)

    @pytest.mark.parametrize(
        ("lookahead_s", "yaw"), [(0.0, 0.0), (0.25, 0.5), (0.5, 1.0), (0.75, 1.1), (9.0, 1.2)]
    )
    def test_yaw_may_be_taken_at_a_time_along_the_trajectory(self, lookahead_s, yaw):
        # Poses at 0, 0.5 and 1 s with yaw 0, 1 and 1.2; the last one is there twice.
        critic = make(RotateToGoal, lookahead_time=lookahead_s)
        scene = scene_of(
            [[(0, 0, 0.0), (0, 0, 1.0), (0, 0, 1.2)]], step_s=0.5, goal=(0.2, 0.0, 0.0)
        )
        scores, _ = critic.score(scene, RotateToGoalMemory(True, True))
        assert scores[0] == pytest.approx(yaw, abs=1e-9)


class TestOscillation:
    critic = make(Oscillation)

    def drive(self, critic, steps, memory=None):
        """Returns the memory after (time s, pose, command) steps."""
        memory = critic.initial_memory() if memory is None else memory
        for time_s, pose, command in steps:
            situation = situate(time_s=time_s, pose=pose)
            memory = critic.debrief(situation, np.array(command, dtype=float), memory)
        return memory

    def legal(self, memory, *commands):
        return [reason is None for reason in score_commands(self.critic, commands, memory)[1]]

    def test_reversal_bans_the_way_back(self):
        here = (0.0, 0.0, 0.0)
        memory = self.drive(self.critic, [(0.0, here, (0.2, 0, 0)), (0.05, here, (-0.2, 0, 0))])
        assert memory.trends[0] == Trend(sign=-1, negative_only=True)
        assert self.legal(memory, (0.1, 0, 0), (-0.1, 0, 0), (0, 0, 1)) == [False, True, True]

    def test_zero_changes_nothing_in_between(self):
        here = (0.0, 0.0, 0.0)
        commands = [(0, 0, 0.3), (0, 0, 0.0), (0, 0, -0.3)]
        memory = self.drive(self.critic, [(0.0, here, command) for command in commands])
        assert self.legal(memory, (0.5, 0, 0.1), (0.5, 0, -0.1)) == [False, True]

    def test_turning_is_watched_only_while_hardly_driving(self):
        here = (0.0, 0.0, 0.0)
        commands = [(0.06, 0, 0.3), (0.06, 0, -0.3)]
        memory = self.drive(self.critic, [(0.0, here, command) for command in commands])
        assert memory.trends[2] == Trend()
        always = make(Oscillation, x_only_threshold=-1.0)
        memory = self.drive(always, [(0.0, here, command) for command in commands])
        assert memory.trends[2] == Trend(sign=-1, negative_only=True)

    @pytest.mark.parametrize(
        ("pose", "ends"),
        [
            ((0.05, 0.0, 0.0), False),
            ((0.03, 0.041, 0.0), True),  # sqrt(0.03^2 + 0.041^2) = 0.0508
            ((0.0, 0.0, 0.2), False),
            ((0.0, 0.0, -0.21), True),
        ],
    )
    def test_ban_ends_with_way_or_turn(self, pose, ends):
        here = (0.0, 0.0, 0.0)
        steps = [(0.0, here, (0.2, 0, 0)), (0.05, here, (-0.2, 0, 0)), (0.1, pose, (-0.2, 0, 0))]
        memory = self.drive(self.critic, steps)
        assert memory.trends[0].is_restricted != ends

    def test_turn_is_measured_the_short_way_round(self):
        flip, later = (0.0, 0.0, 3.1), (0.0, 0.0, -3.1)
        steps = [(0.0, flip, (0.2, 0, 0)), (0.05, flip, (-0.2, 0, 0)), (0.1, later, (-0.2, 0, 0))]
        # From 3.1 to -3.1 it is 2 pi - 6.2 = 0.083 rad.
        assert self.drive(self.critic, steps).trends[0].is_restricted

    @pytest.mark.parametrize(("release", "ends"), [("kilted", True), ("lyrical", False)])
    def test_up_to_kilted_the_step_at_half_a_turn_counts_as_a_turn(self, release, ends):
        critic = Oscillation(
            Oscillation.Parameters(), parameters(nav2_release=release), setup=SETUP
        )
        # The base counts on, Nav2 reads 3.15 rad from a quaternion as 3.15 - 2 pi = -3.13 rad.
        flip, later = (0.0, 0.0, 3.13), (0.0, 0.0, 3.15)
        steps = [(0.0, flip, (0.2, 0, 0)), (0.05, flip, (-0.2, 0, 0)), (0.1, later, (-0.2, 0, 0))]
        assert self.drive(critic, steps).trends[0].is_restricted != ends

    def test_ban_ends_in_the_eighth_cycle_after_the_change_at_20_hz_and_0_35_s(self):
        critic = make(Oscillation, oscillation_reset_time=0.35)
        here = (0.0, 0.0, 0.0)
        for start in range(0, 200, 7):
            times = [0.05 * (start + k) for k in range(12)]
            memory = self.drive(critic, [(times[0], here, (0.2, 0, 0))])
            restricted = []
            for time_s in times[1:]:
                memory = self.drive(critic, [(time_s, here, (-0.2, 0, 0))], memory)
                restricted.append(memory.trends[0].is_restricted)
            # The change is in the first of these cycles; the seventh after it is at 0.35 s exactly.
            assert restricted == [True] * 8 + [False] * 3

    def test_new_plan_forgets_bans_but_keeps_where_the_last_change_was(self):
        memory = OscillationMemory((Trend(1, True, False),) * 3, (1.0, 2.0, 3.0), 7)
        assert self.critic.reset(memory) == OscillationMemory(
            (Trend(), Trend(), Trend()), (1.0, 2.0, 3.0), 7
        )

    @given(st.lists(st.sampled_from([-0.3, 0.0, 0.3]), max_size=12))
    def test_mirrored_commands_give_mirrored_bans(self, rates):
        here = (0.0, 0.0, 0.0)
        left, right = (
            self.drive(self.critic, [(0.0, here, (0, 0, side * rate)) for rate in rates])
            for side in (1, -1)
        )
        assert left.trends[2].positive_only == right.trends[2].negative_only
        assert left.trends[2].negative_only == right.trends[2].positive_only
        assert left.trends[2].sign == -right.trends[2].sign
