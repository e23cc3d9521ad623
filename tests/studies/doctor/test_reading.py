"""The ranking of suspects, and the words of a user that change it."""

from __future__ import annotations

import pytest
from doctor_texts import (
    DWB,
    DWB_BLOCK,
    MPPI,
    MPPI_BLOCK,
    RPP,
    RPP_BLOCK,
    nav2_text,
)

from drake_navbench.errors import InputError
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.complaints import symptoms_called, symptoms_told
from drake_navbench.studies.doctor.in_effect import is_in_effect
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.reading import findings_of, suspicions_of
from drake_navbench.studies.doctor.suspects import all_suspects, ranges
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE, Symptom


def test_every_symptom_has_suspects_of_every_controller():
    kinds = ("mppi", "dwb", "rpp", "teb", "graceful")
    for symptom in Symptom:
        for kind in kinds:
            assert any(
                s.symptom is symptom and {"any", kind} & {*s.kinds} for s in all_suspects()
            ), f"{symptom} of {kind}"
        assert LOOKS_LIKE[symptom]


def test_usual_ranges_begin_below_their_end():
    for place, (low, high) in ranges().items():
        assert low is None or high is None or low <= high, place


def test_layers_that_are_not_listed_say_nothing(facts):
    local = {"static_layer": {"plugin": "x", "obstacle_max_range": 99.0}}
    found = facts(nav2_text(RPP_BLOCK, plugin=RPP, local_costmap=local))
    assert found["local_costmap.obstacle_max_range"] == 3.0


def test_a_value_beyond_its_range_makes_a_suspect_of_it(facts):
    wide = facts(nav2_text(MPPI_BLOCK | {"wz_std": 0.9}, plugin=MPPI))
    first = suspicions_of(wide, Symptom.WOBBLE_STRAIGHT)[0]
    assert first.cause.key == ("controller.wz_std", Direction.DOWN)
    narrow = facts(nav2_text(MPPI_BLOCK | {"wz_std": 0.1}, plugin=MPPI))
    places = [s.cause.place for s in suspicions_of(narrow, Symptom.WOBBLE_STRAIGHT)[:3]]
    assert "controller.wz_std" not in places


def test_what_a_switch_turns_off_is_no_suspect(facts):
    def places(is_scaled):
        block = RPP_BLOCK | {"use_velocity_scaled_lookahead_dist": is_scaled}
        found = suspicions_of(facts(nav2_text(block, plugin=RPP)), Symptom.WOBBLE_STRAIGHT)
        return {s.cause.place.removeprefix("controller.") for s in found}

    near, scaled = places(False), places(True)
    assert ("lookahead_dist" in near, "lookahead_time" in near) == (True, False)
    assert ("lookahead_dist" in scaled, "lookahead_time" in scaled) == (False, True)


def test_words_of_the_user_change_the_order(facts):
    found = facts(nav2_text(RPP_BLOCK, plugin=RPP))
    plain = [s.cause.place for s in suspicions_of(found, Symptom.WOBBLE_STRAIGHT)]
    told = [
        s.cause.place
        for s in suspicions_of(found, Symptom.WOBBLE_STRAIGHT, Told("a debug build, loop at 5 Hz"))
    ]
    assert told.index("outside.compute") < plain.index("outside.compute")
    assert told[0] == "outside.compute"


def test_a_server_that_is_not_there_is_no_suspect(facts):
    found = facts(nav2_text(RPP_BLOCK, plugin=RPP))
    places = {s.cause.place for s in suspicions_of(found, Symptom.STOP_START_JERK)}
    assert "velocity_smoother.velocity_timeout" not in places
    assert "velocity_smoother" in places


def test_a_tolerance_of_dwb_that_only_a_missing_critic_reads_is_not_in_effect(facts):
    own = DWB_BLOCK | {"xy_goal_tolerance": 0.1}
    place = "controller.xy_goal_tolerance"
    assert is_in_effect(facts(nav2_text(own, plugin=DWB)), place)
    without = own | {"critics": ["BaseObstacle", "PathDist", "GoalDist"]}
    assert not is_in_effect(facts(nav2_text(without, plugin=DWB)), place)


def test_symptoms_are_known_by_their_class_and_by_other_words():
    assert symptoms_called("goal_overshoot") == [Symptom.GOAL_OVERSHOOT]
    assert symptoms_called("oscillates at the goal")[0] is Symptom.GOAL_OSCILLATION
    assert symptoms_called("weaves")[0] is Symptom.WOBBLE_STRAIGHT
    assert symptoms_called("crashes into walls")[0] is Symptom.COLLISION
    assert (
        symptoms_told("it creeps the last half metre to its goal")[0] is Symptom.STALL_BEFORE_GOAL
    )
    with pytest.raises(InputError, match=r"expected one of wobble_straight, .*localization_jumps"):
        symptoms_called("purple")


@pytest.mark.parametrize("words", ["no path", "No plan", "no route"])
def test_a_path_that_is_not_there_is_none_that_the_robot_leaves(words):
    assert symptoms_told(words)[0] is Symptom.PLANNER_FAILS
    assert symptoms_told("off the path")[0] is Symptom.CORNER_CUTTING


def test_what_a_file_without_costmaps_gives_is_not_named_by_the_user(facts):
    whole = nav2_text(RPP_BLOCK, plugin=RPP)
    part = facts(whole[: whole.index("local_costmap:")])
    assert not part.is_whole
    reasons = [r for s in suspicions_of(part, Symptom.WOBBLE_STRAIGHT) for r in s.reasons]
    assert "You named its value." not in reasons
    assert "controller.lookahead_dist" in {
        s.cause.place for s in suspicions_of(part, Symptom.WOBBLE_STRAIGHT)
    }


def test_a_value_far_beyond_the_other_end_of_its_range_speaks_more_against_a_cause(facts):
    def score(wz_std):
        found = facts(nav2_text(MPPI_BLOCK | {"wz_std": wz_std}, plugin=MPPI))
        keys = {s.cause.key: s.score for s in suspicions_of(found, Symptom.WOBBLE_STRAIGHT)}
        return keys["controller.wz_std", Direction.DOWN]

    # The usual range is 0.25 to 0.4 rad/s; 0.1 is less than half of its lower end.
    assert score(0.9) > score(0.3) > score(0.2) > score(0.1)


def test_values_of_a_costmap_whose_name_stands_there_once_are_nobody_s(facts):
    """Its scan marks farther than it clears, but no node reads that."""
    scan = "scan: {obstacle_max_range: 5.0, raytrace_max_range: 2.0, max_obstacle_height: 2.0}"
    layer = (
        "plugins: [obstacle_layer], obstacle_layer: {plugin: nav2_costmap_2d::ObstacleLayer, "
        f"observation_sources: scan, {scan}}}"
    )
    rule = "marks-farther-than-it-clears"

    def fired(node):
        server = f"ros__parameters: {{FollowPath: {{plugin: {RPP}}}}}"
        text = f"controller_server: {{{server}}}\n{node % f'{{ros__parameters: {{{layer}}}}}'}\n"
        return {finding.rule.name for finding in findings_of(facts(text))}

    assert rule in fired("local_costmap: {local_costmap: %s}")
    assert rule not in fired("local_costmap: %s")
    assert "costmap-named-once" in fired("local_costmap: %s")


def test_a_cause_that_a_rule_sees_is_told_once():
    """What the rule sees in this file; not what is said of any file in other words."""
    facts = facts_of_values("mppi", Release.JAZZY, {"CostCritic.consider_footprint": False})
    seen = [s for symptom in Symptom for s in suspicions_of(facts, symptom) if s.findings]
    assert seen
    for suspicion in seen:
        assert {*suspicion.reasons} <= {f.seen for f in suspicion.findings}
