"""Values far from Nav2's default and nav2_bringup's, and costmaps that disagree."""

from __future__ import annotations

import pytest
from doctor_texts import DWB, DWB_BLOCK, MPPI, MPPI_BLOCK, RPP, RPP_BLOCK, cures_of, nav2_text
from nav2_setups import read_nav2_files

from drake_navbench.commands.doctor import main
from drake_navbench.inputs.robot import load_robot
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.facts import facts_of
from drake_navbench.studies.doctor.far_values import MOST
from drake_navbench.studies.doctor.reading import findings_of
from drake_navbench.studies.doctor.usual import unusual_value


@pytest.fixture
def found(tmp_path):
    def of(text):
        path = tmp_path / "nav2.yaml"
        path.write_text(text)
        setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair", release="jazzy")
        return findings_of(facts_of(setup, setup.presets[0]))

    return of


def far(findings):
    return [f for f in findings if f.rule.name.startswith("far-")]


def test_a_value_far_from_both_is_told_last_with_its_way_back(found):
    # GoalCritic's weight is 5.0 in Nav2: 5.0 / 1.25 = 4.
    block = MPPI_BLOCK | {"GoalCritic": {"cost_weight": 1.25}}
    findings = found(nav2_text(block, plugin=MPPI))
    (finding,) = far(findings)
    assert findings[-1] is finding
    assert finding.seen.startswith("GoalCritic.cost_weight is 1.25, 0.25 times the usual 5 (Nav2's")
    assert cures_of(finding) == "raise GoalCritic.cost_weight to 5.0"
    # Just 0.4 times is not less than that; just 2.5 times is far.
    for weight, is_far in ((2.0, False), (1.99, True), (12.4, False), (12.5, True)):
        text = nav2_text(MPPI_BLOCK | {"GoalCritic": {"cost_weight": weight}}, plugin=MPPI)
        assert bool(far(found(text))) is is_far


def test_a_value_that_nobody_reads_is_not_far(found):
    """A tenth of DWB's usual 0.325 m, for a critic of DWB in a block of RPP."""
    critic = {"GoalAlign": {"forward_point_distance": 0.0325}}
    assert far(found(nav2_text(RPP_BLOCK | critic, plugin=RPP))) == []
    listed = DWB_BLOCK | critic | {"critics": [*DWB_BLOCK["critics"], "GoalAlign"]}
    assert len(far(found(nav2_text(listed, plugin=DWB)))) == 1


def test_a_length_that_the_speed_explains_is_not_far(found):
    # Three times bringup's lookahead of 0.6 m, at three times its speed of 0.5 m/s.
    fast = RPP_BLOCK | {"lookahead_dist": 1.8, "desired_linear_vel": 1.5}
    assert far(found(nav2_text(fast, plugin=RPP))) == []
    slow = RPP_BLOCK | {"lookahead_dist": 1.8}
    told = " ".join(f.seen for f in found(nav2_text(slow, plugin=RPP)))
    assert "lookahead_dist" in told


def test_a_time_step_that_the_period_explains_is_not_far(found):
    # Four times bringup's 0.05 s, at a control period of 0.2 s; 14 such steps are its 2.8 s.
    text = nav2_text(MPPI_BLOCK | {"model_dt": 0.2, "time_steps": 14}, plugin=MPPI)
    slow = text.replace("controller_frequency: 20.0", "controller_frequency: 5.0")
    assert slow != text
    assert far(found(slow)) == []


def test_the_last_speed_of_an_approach_that_is_switched_off_is_not_far(found):
    last = RPP_BLOCK | {"min_approach_linear_velocity": 0.5}
    told = [f.rule.name for f in far(found(nav2_text(last, plugin=RPP)))]
    assert told == ["far-min_approach_linear_velocity"]
    off = last | {"approach_velocity_scaling_dist": 0.0}
    assert far(found(nav2_text(off, plugin=RPP))) == []


def test_what_is_the_robots_own_matter_is_never_far(found):
    # Speeds, low accelerations, sensors, and a heading that nobody asks for.
    block = DWB_BLOCK | {"max_vel_theta": 0.3, "acc_lim_theta": 0.8, "vy_samples": 1}
    text = nav2_text(block, plugin=DWB).replace("yaw_goal_tolerance: 0.25", "yaw_goal_tolerance: 6")
    assert far(found(text)) == []
    steep = DWB_BLOCK | {"acc_lim_theta": 12.8}
    assert [f.rule.name for f in far(found(nav2_text(steep, plugin=DWB)))] == ["far-acc_lim_theta"]


def test_a_whole_number_is_set_back_to_a_whole_number(found):
    (few,) = far(found(text := nav2_text(MPPI_BLOCK | {"time_steps": 20}, plugin=MPPI)))
    assert "time_steps: 20" in text
    assert cures_of(few) == "raise time_steps to 56"


def test_at_most_three_far_values_are_told_and_none_that_a_rule_tells(found):
    # Weights of 5, 14 and 5, all far below; a rule tells of PathAlignCritic's.
    block = MPPI_BLOCK | {name: {"cost_weight": 0.5} for name in MPPI_BLOCK["critics"][1:]}
    findings = found(nav2_text(block | {"gamma": 0.2, "sgf_order": 5}, plugin=MPPI))
    assert "mppi-weak-path-align" in {f.rule.name for f in findings}
    told = far(findings)
    assert len(told) == MOST
    assert "PathAlignCritic" not in " ".join(f.seen for f in told)


def _with_global(radius_m):
    inflation = {"plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": radius_m}
    parameters = {"plugins": ["inflation_layer"], "inflation_layer": inflation}
    text = nav2_text(RPP_BLOCK, plugin=RPP, global_costmap=parameters)
    return text.replace("global_costmap:\n", "global_costmap/global_costmap:\n")


def test_two_costmaps_that_inflate_differently_are_found_with_the_odder_one(found):
    # 0.7 m / 0.25 m = 2.8; bringup has 0.55 to 0.7 m, so the global one is the odd one.
    told = {f.rule.name: f for f in found(_with_global(0.25))}
    finding = told["global-inflation-radius-below"]
    assert "global_costmap.inflation_radius is 0.25, but local_costmap.inflation_radius 0.7" in (
        finding.seen
    )
    # Bringup's 0.55 m is nearer than the local costmap's 0.7 m.
    assert cures_of(finding) == "raise global_costmap.inflation_radius to 0.55 m"
    assert finding.cures[0].key == ("global_costmap.inflation_radius", Direction.UP)
    # 0.7 / 0.35 = 2.
    assert not {f.rule.name for f in found(_with_global(0.35))} & {*told} - {"plans-inflate-little"}


def test_brakes_that_are_weak_beside_the_accelerations_are_found(found):
    # 2.5 / 1.0 = 2.5.
    weak = {f.rule.name for f in found(nav2_text(DWB_BLOCK | {"decel_lim_x": -1.0}, plugin=DWB))}
    assert "dwb-brakes-weaker-than-it-accelerates" in weak
    even = {f.rule.name for f in found(nav2_text(DWB_BLOCK | {"decel_lim_x": -1.25}, plugin=DWB))}
    assert "dwb-brakes-weaker-than-it-accelerates" not in even


def test_a_wild_acceleration_is_lowered_and_not_the_brakes_made_as_wild(found):
    name = "dwb-brakes-weaker-than-it-accelerates"
    cures = {}
    for accelerates, brakes in ((10.0, -2.5), (10.0, -1.0)):
        block = DWB_BLOCK | {"acc_lim_x": accelerates, "decel_lim_x": brakes}
        fired = {f.rule.name: f for f in found(nav2_text(block, plugin=DWB))}
        cures[brakes] = [cause.to for cause in fired[name].cures]
    assert cures == {-2.5: [2.5], -1.0: [-2.5, 1.0]}


def test_the_command_tells_far_values_after_the_rules_of_the_symptom(tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    block = MPPI_BLOCK | {"vx_min": 0.0, "GoalCritic": {"cost_weight": 1.25}}
    path.write_text(nav2_text(block, plugin=MPPI))
    main([str(path), "--read-only", "--symptom", "no_turning"])
    names = [line[2:] for line in capsys.readouterr().out.splitlines() if line.startswith("- ")]
    assert names[-1].startswith("far-cost_weight")
    assert any(name.startswith("mppi-no-reverse") for name in names[:-1])


def test_a_whole_number_is_told_as_one_since_nav2_refuses_20_point_0_for_it(tmp_path, capsys):
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(DWB_BLOCK | {"vtheta_samples": 60}, plugin=DWB))
    main([str(path), "--read-only"])
    told = " ".join(capsys.readouterr().out.split())
    assert "lower FollowPath.vtheta_samples to 20 source" in told


def test_a_low_limit_of_a_turns_acceleration_is_the_robots_own(found):
    def names(limit):
        text = nav2_text(RPP_BLOCK, plugin=RPP, behavior_server={"rotational_acc_lim": limit})
        return {f.rule.name for f in far(found(text))}

    # Nav2's is 3.2 rad/s^2.
    assert "far-rotational_acc_lim" not in names(0.5)
    assert "far-rotational_acc_lim" in names(32.0)


@pytest.mark.parametrize(("inflation_m", "is_far"), [(0.05, False), (0.55, True)])
def test_a_scaling_distance_within_a_small_inflation_is_not_far(found, inflation_m, is_far):
    """0.03 m are 0.05 times Nav2's 0.6 m; an inflation of 0.05 m is 0.09 times bringup's."""
    scaled = {"use_cost_regulated_linear_velocity_scaling": True, "cost_scaling_dist": 0.03}
    text = nav2_text(RPP_BLOCK | scaled, plugin=RPP).replace("0.7", str(inflation_m))
    assert any("cost_scaling_dist" in f.rule.name for f in far(found(text))) is is_far


@pytest.mark.parametrize(("radius_m", "is_far"), [(0.03, False), (0.19, True)])
def test_a_tiny_robots_costmap_has_small_cells(found, radius_m, is_far):
    """0.019 m are less than 0.4 times bringup's 0.05 m."""
    costmap = {"resolution": 0.019, "robot_radius": radius_m, "footprint": ""}
    text = nav2_text(RPP_BLOCK, plugin=RPP, local_costmap=costmap)
    assert any("resolution" in f.rule.name for f in far(found(text))) is is_far


def test_the_velocity_thresholds_of_nav2_bringup_are_usual(tmp_path):
    """Nav2's code has 0.0001 m/s and rad/s, nav2_bringup's own file 0.001."""
    path = tmp_path / "nav2.yaml"
    server = {"min_x_velocity_threshold": 0.001, "min_theta_velocity_threshold": 0.01}
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP, controller_server=server))
    setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair", release="jazzy")
    facts = facts_of(setup, setup.presets[0])
    assert unusual_value(facts, "controller_server.min_x_velocity_threshold") is None
    far = unusual_value(facts, "controller_server.min_theta_velocity_threshold")
    assert far is not None
    assert far.nearest == 0.001
