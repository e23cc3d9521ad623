"""Rules over the resolved parameters of a file: what each finds, and what it leaves alone."""

from __future__ import annotations

import pytest
import yaml
from doctor_texts import (
    DWB,
    DWB_BLOCK,
    MPPI,
    MPPI_BLOCK,
    RPP,
    RPP_BLOCK,
    SHIM,
    cures_of,
    nav2_text,
)

from drake_navbench.studies.doctor.reading import RULES, findings_of, suspicions_of
from drake_navbench.studies.doctor.suspects import all_suspects
from drake_navbench.studies.doctor.symptoms import Symptom

# MPPI refuses to look at the outline of a robot that is given by its radius, where it is no use.
FOR_ROUND = "mppi-footprint-for-a-radius"


def fired(facts):
    return {finding.rule.name: finding.seen for finding in findings_of(facts)}


def test_there_are_at_least_60_rules_each_with_its_own_name_and_a_source():
    assert len(RULES) >= 60
    assert len({rule.name for rule in RULES}) == len(RULES)
    assert all(rule.source and rule.cures and rule.symptoms for rule in RULES)


def test_nothing_switches_off_a_check_of_collisions():
    """A robot that checks nothing stops nowhere: that would cure every stop."""
    checks = ("use_collision_detection", "consider_footprint", "include_costmap_obstacles")
    ruled = [cause for rule in RULES if not rule.name.startswith(FOR_ROUND) for cause in rule.cures]
    for cause in [*(suspect.cause for suspect in all_suspects()), *ruled]:
        assert not (cause.place.endswith(checks) and cause.to is False), cause


def test_a_critic_that_looks_at_the_centre_alone_is_found_for_a_long_robot(facts):
    # 0.8 x 0.4 m: the outline reaches from 0.2 to 0.45 m.
    seen = fired(facts(nav2_text(MPPI_BLOCK, plugin=MPPI)))
    assert "0.21 to 0.46 m" in seen["mppi-centre-alone"]
    heeded = MPPI_BLOCK | {"CostCritic": {"consider_footprint": True}}
    assert "mppi-centre-alone" not in fired(facts(nav2_text(heeded, plugin=MPPI)))


def test_an_outline_that_reaches_beyond_the_inflation_is_found_where_it_is_not_looked_at(facts):
    # The outline reaches 0.46 m with its padding; cells farther than 0.4 m cost nothing.
    text = nav2_text(MPPI_BLOCK | {"CostCritic": {"consider_footprint": True}}, plugin=MPPI)
    narrow = text.replace("inflation_radius: 0.7", "inflation_radius: 0.4")
    rule = "mppi-outline-beyond-inflation"
    assert "reaches 0.46 m" in fired(facts(narrow, release="iron"))[rule]
    # Jazzy's CostCritic looks at every outline then.
    assert rule not in fired(facts(narrow))
    assert rule not in fired(facts(text, release="iron"))


def test_dwb_without_the_outlines_critic_is_found(facts):
    assert "dwb-centre-alone" in fired(facts(nav2_text(DWB_BLOCK, plugin=DWB)))
    heeded = DWB_BLOCK | {"critics": [*DWB_BLOCK["critics"], "ObstacleFootprint"]}
    assert "dwb-centre-alone" not in fired(facts(nav2_text(heeded, plugin=DWB)))


@pytest.mark.parametrize(("time_s", "told"), [(1.5, "memory"), (0.0, "equal"), (-1.0, "")])
def test_a_heading_that_rotate_to_goal_looks_for_ahead_is_told(facts, time_s, told):
    own = {"critics": ["RotateToGoal"], "RotateToGoal.lookahead_time": time_s}
    found = fired(facts(nav2_text(DWB_BLOCK | own, plugin=DWB)))
    assert told in found.get("dwb-rotate-to-goal-looks-ahead", "")
    assert ("dwb-rotate-to-goal-looks-ahead" in found) == bool(told)


def test_a_horizon_beyond_half_the_window_is_found(facts):
    # 1.5 m/s for 56 steps of 0.05 s is 4.2 m, half of the window 2.5 m.
    seen = fired(facts(nav2_text(MPPI_BLOCK | {"vx_max": 1.5}, plugin=MPPI)))
    assert "samples reach 4.2 m" in seen["mppi-horizon-beyond-window"]
    assert "mppi-horizon-beyond-window" not in fired(facts(nav2_text(MPPI_BLOCK, plugin=MPPI)))


def test_a_smoothers_timeout_below_late_cycles_is_found(facts):
    smoother = {"velocity_timeout": 0.2, "smoothing_frequency": 20.0}
    seen = fired(facts(nav2_text(RPP_BLOCK, plugin=RPP, velocity_smoother=smoother)))
    assert "velocity_timeout is 0.2 s" in seen["smoother-timeout-below-late-cycles"]
    patient = smoother | {"velocity_timeout": 1.0}
    text = nav2_text(RPP_BLOCK, plugin=RPP, velocity_smoother=patient)
    assert "smoother-timeout-below-late-cycles" not in fired(facts(text))


def test_odometry_that_only_the_navigator_is_told_of_is_found(facts):
    navigator = {"odom_topic": "/base_controller/odom"}
    text = nav2_text(RPP_BLOCK, plugin=RPP, bt_navigator=navigator)
    assert "odometry-of-another-topic" in fired(facts(text))
    told = nav2_text(
        RPP_BLOCK | {}, plugin=RPP, bt_navigator=navigator, controller_server={}
    ).replace("controller_frequency: 20.0", "odom_topic: /base_controller/odom")
    assert "odometry-of-another-topic" not in fired(facts(told))


def test_no_cure_makes_the_controller_listen_to_maps_for_odometry(facts):
    text = nav2_text(RPP_BLOCK, plugin=RPP, bt_navigator={"odom_topic": "/map"})
    assert "odometry-of-another-topic" not in fired(facts(text))


def test_the_gap_between_the_goals_tolerance_and_the_shims_threshold_is_found(facts):
    block = {"primary_controller": RPP, "angular_dist_threshold": 0.785, **RPP_BLOCK}
    text = nav2_text(block, plugin=SHIM)
    assert "shim-gap-of-two-thresholds" in fired(facts(text))
    turning = nav2_text(block | {"rotate_to_goal_heading": True}, plugin=SHIM)
    assert "shim-gap-of-two-thresholds" not in fired(facts(turning))
    # Humble does not read rotate_to_goal_heading: there the cure is an upgrade.
    old = facts(text, release="humble")
    assert "shim-gap-of-two-thresholds" not in fired(old)
    first = suspicions_of(old, Symptom.GOAL_NOT_REACHED)[0]
    assert first.cause.place != "controller.rotate_to_goal_heading"


@pytest.mark.parametrize(
    ("block", "release", "is_told"),
    [
        ({"lookahead_dist": 0.25}, "humble", True),
        ({"lookahead_dist": 0.25}, "lyrical", False),
        ({"lookahead_dist": 0.3}, "humble", False),
        ({"lookahead_dist": 0.25, "use_rotate_to_heading": False}, "humble", False),
        ({"use_velocity_scaled_lookahead_dist": True, "min_lookahead_dist": 0.2}, "jazzy", True),
    ],
)
def test_a_carrot_within_the_goals_tolerance_is_taken_for_the_goal(facts, block, release, is_told):
    # Nav2's xy_goal_tolerance is 0.25 m.
    text = nav2_text({**RPP_BLOCK, "use_rotate_to_heading": True, **block}, plugin=RPP)
    assert ("rpp-carrot-within-tolerance" in fired(facts(text, release=release))) == is_told


def test_what_nav2_bringup_ships_is_no_fault(facts):
    # trans_stopped_velocity 0.25 of 0.26 m/s: it stops within 0.25^2 / 5 + 0.25 / 20 = 0.025 m.
    block = DWB_BLOCK | {"max_vel_x": 0.26, "max_speed_xy": 0.26, "trans_stopped_velocity": 0.25}
    block["critics"] = [*DWB_BLOCK["critics"], "ObstacleFootprint"]
    assert fired(facts(nav2_text(block, plugin=DWB))) == {}
    slow = nav2_text(block, plugin=DWB).replace("frequency: 20.0", "frequency: 2.0")
    assert "rolls 0.14 m" in fired(facts(slow))["dwb-turns-while-rolling"]
    # A file that Kilted ships names what is read for a car alone.
    car = MPPI_BLOCK | {"AckermannConstraints": {"min_turning_r": 0.2}}
    assert "controller-parameters-not-read" not in fired(facts(nav2_text(car, plugin=MPPI)))


def test_an_outline_that_the_file_does_not_give_is_nav2s_and_not_the_robots(facts):
    text = nav2_text(DWB_BLOCK, plugin=DWB).replace("    footprint:", "    footprint_topic:")
    seen = fired(facts(text))
    assert "outline-not-given" in seen
    assert "dwb-centre-alone" not in seen


def test_a_cure_leads_away_from_the_value_in_the_file(facts):
    # 3.5 m/s at 20 Hz: 0.175 m between two commands, more than the tolerance.
    text = nav2_text(MPPI_BLOCK | {"vx_max": 3.5}, plugin=MPPI).replace(
        "xy_goal_tolerance: 0.25", "xy_goal_tolerance: 0.1"
    )
    told = {f.rule.name: cures_of(f) for f in findings_of(facts(text))}
    assert told["goal-smaller-than-a-step"] == "raise goal_checker.xy_goal_tolerance to 0.2 m"
    # A fifth of 3.5 m/s: the usual 0.2, which the file has, is too little for this speed.
    assert told["mppi-narrow-speed-samples"] == "raise vx_std to 0.7 m/s"


def test_what_the_file_has_already_is_no_cure_beside_others(facts):
    """The threshold of turns is Nav2's 0.001 rad/s; that of the speed ahead is not."""
    server = {"min_x_velocity_threshold": 0.2, "min_theta_velocity_threshold": 0.001}
    found = facts(nav2_text(RPP_BLOCK, plugin=RPP, controller_server=server))
    assert cure_of(found, "measured-speed-cut-off") == (
        "lower controller_server.min_x_velocity_threshold to 0.001 m/s"
    )


def test_what_is_not_read_is_told_to_have_no_effect_and_no_symptom(facts):
    (finding,) = findings_of(facts(nav2_text(RPP_BLOCK | {"look_ahead": 1.0}, plugin=RPP)))
    assert finding.seen == (
        "Nav2 jazzy does not read FollowPath.look_ahead of controller_server: it has no effect"
    )
    assert finding.likely == []
    assert "critics" not in cures_of(finding)


def test_dwb_drives_no_faster_than_its_limit_of_both_axes(facts):
    """At 0.2 m/s and 10 Hz a command lasts 0.02 m, at 2 m/s it would be 0.2 m."""
    block = DWB_BLOCK | {"max_vel_x": 2.0, "max_speed_xy": 0.2}
    found = facts(nav2_text(block, plugin=DWB, controller_server={"controller_frequency": 10.0}))
    assert (found.speed_mps, found.asked_mps) == (0.2, 2.0)
    assert "slow-loop" not in fired(found)
    assert "less than max_vel_x 2 m/s" in fired(found)["dwb-two-speed-limits"]
    free = facts(nav2_text(block | {"max_speed_xy": -1.0}, plugin=DWB))
    assert free.speed_mps == 2.0


def test_dwb_without_max_speed_xy_never_drives(facts):
    assert "max_speed_xy" not in DWB_BLOCK
    finding = fired(facts(nav2_text(DWB_BLOCK, plugin=DWB)))["dwb-speed-limit-of-zero"]
    assert "so the robot never drives" in finding
    unlimited = facts(nav2_text(DWB_BLOCK | {"max_speed_xy": -1.0}, plugin=DWB))
    assert "dwb-speed-limit-of-zero" not in fired(unlimited)


def test_the_smoother_is_told_the_speed_that_the_controller_asks_for(facts):
    smoother = {"max_velocity": [0.26, 0.0, 1.0], "min_velocity": [-0.26, 0.0, -1.0]}
    found = facts(nav2_text(DWB_BLOCK, plugin=DWB, velocity_smoother=smoother))
    assert cure_of(found, "smoother-cuts-speed") == (
        "raise velocity_smoother.max_velocity to [0.5, 0.0, 1.0]"
    )


def test_a_tolerance_of_a_critic_that_is_not_listed_is_no_fault(facts):
    block = DWB_BLOCK | {"xy_goal_tolerance": 1.0}
    assert "dwb-two-tolerances" in fired(facts(nav2_text(block, plugin=DWB)))
    alone = block | {"critics": ["BaseObstacle", "PathDist", "GoalDist"]}
    assert "dwb-two-tolerances" not in fired(facts(nav2_text(alone, plugin=DWB)))


def test_mppi_without_critics_is_told_with_the_list_that_nobody_reads(facts):
    block = {k: v for k, v in MPPI_BLOCK.items() if k != "critics"}
    block["AckermannConstraints"] = {"critics": MPPI_BLOCK["critics"]}
    seen = fired(facts(nav2_text(block, plugin=MPPI)))["mppi-no-critics"]
    assert seen.endswith("the list FollowPath.AckermannConstraints.critics is read by nobody")
    assert "mppi-no-critics" not in fired(facts(nav2_text(MPPI_BLOCK, plugin=MPPI)))


def test_a_deadband_that_only_cuts_what_moves_no_robot_is_none(facts):
    def text(*deadband):
        return nav2_text(
            RPP_BLOCK, plugin=RPP, velocity_smoother={"deadband_velocity": list(deadband)}
        )

    assert "smoother-deadband" not in fired(facts(text(0.0, 0.0, 0.04)))
    assert "smoother-deadband" in fired(facts(text(0.1, 0.0, 0.0)))


def test_a_layer_whose_name_says_nothing_may_see_obstacles(facts):
    types = {
        "camera": "VoxelLayer",
        "static_layer": "StaticLayer",
        "inflation_layer": "InflationLayer",
    }

    def seen(*layers):
        local = {"plugins": list(layers)} | {
            name: {"plugin": f"nav2_costmap_2d::{types[name]}"} for name in layers
        }
        return fired(facts(nav2_text(RPP_BLOCK, plugin=RPP, local_costmap=local)))

    assert "no-obstacle-layer" not in seen("camera", "inflation_layer")
    assert "no-obstacle-layer" in seen("static_layer", "inflation_layer")


def test_the_same_odometry_within_a_namespace_is_no_other(facts):
    text = nav2_text(RPP_BLOCK, plugin=RPP, bt_navigator={"odom_topic": "/robot1/odom"})
    text = text.replace("topic: /scan", "topic: /robot1/scan")
    assert "odometry-of-another-topic" not in fired(facts(text))


def test_values_laid_over_another_file_lack_nothing(facts):
    own = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))
    local = own["local_costmap"]["local_costmap"]["ros__parameters"]
    del local["footprint"], local["obstacle_layer"]["observation_sources"]
    whole = {"outline-not-given", "layer-sees-nothing"}
    assert whole <= fired(facts(yaml.safe_dump(own))).keys()
    del local["plugins"]
    assert not whole & fired(facts(yaml.safe_dump(own))).keys()


@pytest.mark.parametrize(("release", "is_told"), [("humble", True), ("jazzy", False)])
def test_up_to_iron_a_layer_with_an_unknown_method_adds_nothing(facts, release, is_told):
    own = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))
    own["local_costmap"]["local_costmap"]["ros__parameters"]["obstacle_layer"][
        "combination_method"
    ] = 3
    found = fired(facts(yaml.safe_dump(own), release=release))
    assert ("layer-adds-nothing-local_costmap" in found) == is_told


def test_an_inflation_that_is_shorter_than_the_outline_by_rounding_is_none(facts):
    # The wheelchair-like outline is 0.21 m to the side with its padding.
    def of(radius_m):
        text = nav2_text(RPP_BLOCK, plugin=RPP)
        return fired(facts(text.replace("inflation_radius: 0.7", f"inflation_radius: {radius_m}")))

    assert "inflation-below-inscribed-radius" in of(0.19)
    assert "inflation-below-inscribed-radius" not in of(0.205)


def cure_of(facts, rule):
    return next(cures_of(f) for f in findings_of(facts) if f.rule.name == rule)


def test_a_cure_tells_the_value_that_the_rule_computes(facts):
    # The control period of 30 Hz is 0.0333 s, less than MPPI's step of 0.05 s.
    thirty = nav2_text(MPPI_BLOCK, plugin=MPPI, controller_server={"controller_frequency": 30.0})
    assert cure_of(facts(thirty), "mppi-step-above-period") == "lower model_dt to 0.03333 s"
    # With that value the rule no longer fires.
    cured = thirty.replace("model_dt: 0.05", "model_dt: 0.03333")
    assert "mppi-step-above-period" not in fired(facts(cured))


def test_a_cure_that_a_switch_of_the_file_turns_off_is_not_told(facts):
    scaled = {"use_velocity_scaled_lookahead_dist": True, "max_lookahead_dist": 2.0}
    far = RPP_BLOCK | scaled | {"lookahead_time": 4.0, "desired_linear_vel": 0.5}
    told = cure_of(facts(nav2_text(far, plugin=RPP)), "pursuit-far-carrot")
    assert told == "lower max_lookahead_dist to 0.9 m"


@pytest.mark.parametrize(("sideways_mps", "is_fault"), [(0.0, False), (0.4, True)])
def test_a_deadband_sideways_is_a_fault_of_a_base_that_drives_sideways(
    facts, sideways_mps, is_fault
):
    smoother = {"max_velocity": [0.5, sideways_mps, 1.0], "deadband_velocity": [0.0, 1.0, 0.0]}
    text = nav2_text(DWB_BLOCK, plugin=DWB, velocity_smoother=smoother)
    assert ("smoother-deadband" in fired(facts(text))) is is_fault


def test_no_critic_is_missed_in_a_list_that_the_file_does_not_give(facts):
    omni = MPPI_BLOCK | {"motion_model": "Omni"}
    assert "mppi-omni-twirls" in fired(facts(nav2_text(omni, plugin=MPPI)))
    assert "mppi-omni-twirls" not in fired(facts(nav2_text(omni | {"critics": []}, plugin=MPPI)))


@pytest.mark.parametrize(
    ("radius", "told"),
    [
        (0.2, "the controller keeps closer to obstacles than the plan does"),
        (1.8, "the planner plans through cells that the controller avoids"),
    ],
)
def test_of_costmaps_that_differ_the_one_that_inflates_less_is_told(facts, radius, told):
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace(
        "inflation_radius: 0.7", f"inflation_radius: {radius}", 1
    )
    other = {"global_costmap": {"global_costmap": {"ros__parameters": {
        "plugins": ["inflation_layer"],
        "inflation_layer": {"plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": 0.7},
    }}}}  # fmt: skip
    found = fired(facts(yaml.safe_dump(yaml.safe_load(text) | other)))
    (seen,) = [seen for name, seen in found.items() if name.startswith("local-inflation-radius")]
    assert seen.endswith(told)


@pytest.mark.parametrize(
    ("plugin", "block", "rule"),
    [
        # 56 steps of 0.05 s at 1.5 m/s are 4.2 m; the window reaches 2.5 m, as 33 steps do.
        (MPPI, MPPI_BLOCK | {"vx_max": 1.5}, "mppi-horizon-beyond-window"),
        (MPPI, MPPI_BLOCK | {"vx_max": 2.0}, "mppi-narrow-speed-samples"),
        (DWB, DWB_BLOCK | {"decel_lim_x": -0.5}, "dwb-brakes-weaker-than-it-accelerates"),
    ],
)  # fmt: skip
def test_a_cures_value_quiets_its_rule(facts, plugin, block, rule):
    found = facts(nav2_text(block, plugin=plugin))
    (finding,) = [f for f in findings_of(found) if f.rule.name == rule]
    for cause in finding.cures:
        first, _, name = cause.place.partition(".")
        if first != "controller":
            continue
        assert rule not in fired(facts(nav2_text(block | {name: cause.to}, plugin=plugin))), name


def test_dwb_beyond_its_window_gets_a_cure_that_a_robot_can_have(facts):
    """5 m of window reach 2.5 m; 2 m/s for 1.7 s are 3.4 m, 40 m/s for 1.7 s are 68 m."""

    def cure(speed_mps, **nodes):
        block = DWB_BLOCK | {"max_vel_x": speed_mps, "max_speed_xy": -1.0}
        found = facts(nav2_text(block, plugin=DWB, **nodes))
        cures = [cures_of(f) for f in findings_of(found) if f.rule.name == "dwb-beyond-window"]
        return cures[0] if cures else "none"

    assert cure(2.0).startswith("raise local_costmap.width to 7 m; or lower sim_time to 1.25 s;")
    # 68 m ask for a window of 136 m, or for samples of 0.06 s: it is the speed.
    assert cure(40.0) == "lower max_vel_x to 1.471"
    # The robot never drives what the velocity smoother does not let by: 0.5 m/s for 1.7 s.
    assert cure(2.0, velocity_smoother={"max_velocity": [0.5, 0.0, 1.0]}) == "none"


def test_a_loop_is_slow_for_the_speed_that_the_smoother_lets_by(facts):
    """At 10 Hz 2 m/s are 0.2 m from one command to the next, 1 m/s are 0.1 m."""
    block, slow = RPP_BLOCK | {"desired_linear_vel": 2.0}, {"controller_frequency": 10.0}
    free = facts(nav2_text(block, plugin=RPP, controller_server=slow))
    smoother = {"max_velocity": [1.0, 0.0, 2.0]}
    cut = facts(nav2_text(block, plugin=RPP, controller_server=slow, velocity_smoother=smoother))
    assert "at 2 m/s the robot drives 0.20 m" in fired(free)["slow-loop"]
    assert "slow-loop" not in fired(cut)


def test_a_tiny_robots_pose_wanders_less_than_the_robot_is_long(facts):
    """A radius of 0.03 m, half of 0.06 m: half of the usual distances fit."""

    def of(radius_m, tolerance_m):
        checker = {"plugin": "nav2_controller::SimpleGoalChecker"}
        found = facts(
            nav2_text(
                RPP_BLOCK | {"desired_linear_vel": 0.1},
                plugin=RPP,
                controller_server={"goal_checker": checker | {"xy_goal_tolerance": tolerance_m}},
                local_costmap={"footprint": "", "footprint_padding": 0.0, "robot_radius": radius_m},
            ),
        )
        return next((f for f in findings_of(found) if f.rule.name.startswith("goal-smaller")), None)

    assert of(0.03, 0.04) is None
    assert cures_of(of(0.3, 0.04)) == "raise goal_checker.xy_goal_tolerance to 0.2 m"
    tiny = of(0.03, 0.02)
    assert "the 0.03 m by which" in tiny.seen
    assert cures_of(tiny) == "raise goal_checker.xy_goal_tolerance to 0.1 m"


def test_a_decay_other_than_the_costmaps_slows_pursuit_too_late_or_too_early(facts):
    # The local costmap's cost_scaling_factor is 3: a smaller one makes distances look larger.
    on = RPP_BLOCK | {"use_cost_regulated_linear_velocity_scaling": True}
    for factor, name, symptom in (
        (1.0, "rpp-slower-decay-than-costmap", Symptom.NEAR_MISS),
        (9.0, "rpp-steeper-decay-than-costmap", Symptom.TOO_SLOW),
    ):
        text = nav2_text(on | {"inflation_cost_scaling_factor": factor}, plugin=RPP)
        (found,) = [f for f in findings_of(facts(text)) if "-decay-" in f.rule.name]
        assert (found.rule.name, next(iter(found.rule.symptoms))) == (name, symptom)


@pytest.mark.parametrize(("radius_m", "is_told"), [(0.22, False), (0.27, True)])
def test_the_planner_inflates_around_the_global_costmaps_own_radius(facts, radius_m, is_told):
    # 0.3 m of inflation around 0.22 + 0.01 m, or around 0.27 + 0.01 m.
    inflation = {"plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": 0.3}
    parameters = {"robot_radius": radius_m, "plugins": ["inflation"], "inflation": inflation}
    text = nav2_text(RPP_BLOCK, plugin=RPP, global_costmap=parameters)
    text = text.replace("global_costmap:\n", "global_costmap/global_costmap:\n")
    text = text.replace("    footprint:", "    footprint_topic:")
    round_robot = text.replace("rolling_window: true", "robot_radius: 0.25")
    told = {f.rule.name for f in findings_of(facts(round_robot))}
    assert ("plans-inflate-little" in told) is is_told


@pytest.mark.parametrize(
    ("release", "told"),
    [("humble", "humble from 1.1.19 on"), ("jazzy", "jazzy from 1.3.6 on"), ("kilted", "kilted")],
)
def test_a_footprint_to_check_where_there_is_a_radius_names_who_does_not_start(
    facts, release, told
):
    block = MPPI_BLOCK | {
        "critics": ["ObstaclesCritic", "GoalCritic"],
        "ObstaclesCritic": {"consider_footprint": True},
        "CostCritic": {"consider_footprint": True},
    }
    round_robot = {"footprint": "[]", "robot_radius": 0.3}
    seen = fired(facts(nav2_text(block, plugin=MPPI, local_costmap=round_robot), release))
    assert seen[f"{FOR_ROUND}-ObstaclesCritic"].endswith(f"Nav2 {told} does not start")
    # It is not among the critics, so nothing reads its parameters.
    assert f"{FOR_ROUND}-CostCritic" not in seen


def test_a_tolerance_of_the_heading_of_more_than_a_turn_may_be_in_degrees(facts):
    def of(tolerance_rad):
        checker = {"plugin": "nav2_controller::SimpleGoalChecker"}
        server = {"goal_checker": checker | {"yaw_goal_tolerance": tolerance_rad}}
        text = nav2_text(RPP_BLOCK, plugin=RPP, controller_server=server)
        return {found.rule.name: cures_of(found) for found in findings_of(facts(text))}

    # 15 degrees are 0.262 rad.
    name = "goal-heading-in-degrees"
    assert of(15.0)[name] == "set goal_checker.yaw_goal_tolerance to 0.262 rad"
    assert name not in of(3.14)
