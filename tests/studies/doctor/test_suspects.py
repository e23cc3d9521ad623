"""Which suspects count for a file, and how their values weigh."""

from __future__ import annotations

import pytest
from doctor_texts import DWB, DWB_BLOCK, RPP, RPP_BLOCK, nav2_text

from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.partial_files import kind_in
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

LAYER = {
    "plugin": "nav2_costmap_2d::ObstacleLayer",
    "observation_sources": "scan",
    "scan": {"topic": "/scan", "max_obstacle_height": 2.0, "data_type": "LaserScan"},
}


@pytest.fixture
def scores(tmp_path):
    """The scores of a symptom's causes in a file, by place and direction."""

    def of(symptom, words="", block=RPP_BLOCK, plugin=RPP, **nodes):
        path = tmp_path / "nav2.yaml"
        path.write_text(nav2_text(block, plugin=plugin, **nodes))
        facts = Patient((path,), "wheelchair", {}, release="jazzy").facts()
        return {s.cause.key: s.score for s in suspicions_of(facts, symptom, Told(words))}

    return of


def layer(**scan):
    return {"local_costmap": {"obstacle_layer": LAYER | {"scan": LAYER["scan"] | scan}}}


def test_what_is_zero_is_not_lowered(scores):
    down = ("local_costmap.observation_persistence", Direction.DOWN)
    assert down not in scores(Symptom.GHOST_OBSTACLES, **layer(observation_persistence=0.0))
    assert down in scores(Symptom.GHOST_OBSTACLES, **layer(observation_persistence=2.0))
    dead = ("velocity_smoother.deadband_velocity", Direction.DOWN)
    for deadband, is_cause in (([0.0, 0.0, 0.0], False), ([0.1, 0.0, 0.0], True)):
        smoother = {"velocity_smoother": {"deadband_velocity": deadband}}
        assert (dead in scores(Symptom.NO_START, **smoother)) is is_cause


def test_clearing_farther_than_marking_leaves_nothing_beyond(scores):
    up = ("local_costmap.raytrace_max_range", Direction.UP)
    ranges = {"obstacle_max_range": 3.0}
    far = scores(Symptom.GHOST_OBSTACLES, **layer(raytrace_max_range=3.5, **ranges))[up]
    near = scores(Symptom.GHOST_OBSTACLES, **layer(raytrace_max_range=2.5, **ranges))[up]
    assert near > 3.0 * far


def test_a_pursuit_that_may_not_turn_on_the_spot_circles(scores):
    turns = ("controller.use_rotate_to_heading", Direction.SET)
    may_not = scores(Symptom.SPINS, block=RPP_BLOCK | {"use_rotate_to_heading": False})
    may = scores(Symptom.SPINS, block=RPP_BLOCK | {"use_rotate_to_heading": True})
    assert may_not[turns] == 0.35
    assert may[turns] == 0.2  # It is off that is the change.


def test_marks_that_stay_ask_for_more_updates(scores):
    more = ("local_costmap.update_frequency", Direction.UP)
    gone = scores(Symptom.GHOST_OBSTACLES, words="a trail of old marks stays")[more]
    floor = scores(Symptom.GHOST_OBSTACLES, words="the floor is marked")[more]
    assert gone > 2.0 * floor


def test_a_planner_has_only_its_own_parameters(scores):
    hybrid = {"plugin": "nav2_smac_planner::SmacPlannerHybrid"}
    navfn = {"plugin": "nav2_navfn_planner::NavfnPlanner"}
    turning = ("planner.minimum_turning_radius", Direction.DOWN)
    for planner, has_radius in ((hybrid, True), (navfn, False)):
        server = {"planner_server": {"planner_plugins": ["GridBased"], "GridBased": planner}}
        assert (turning in scores(Symptom.PLANNER_FAILS, **server)) is has_radius


def test_default_values_are_less_suspicious_than_given_ones(scores):
    # The usual values are 0.03 to 0.06 m, Nav2's default is 0.1 m.
    down = ("local_costmap.resolution", Direction.DOWN)
    given = {"local_costmap": {"resolution": 0.1}}
    weights = [scores(Symptom.DOOR_STOP, **nodes)[down] for nodes in ({}, given)]
    assert weights[1] > 1.5 * weights[0]


def test_a_smoother_above_the_controllers_speed_does_not_slow_the_robot(scores):
    up = ("velocity_smoother.max_velocity", Direction.UP)
    weights = [
        scores(Symptom.TOO_SLOW, velocity_smoother={"max_velocity": [speed, 0.0, 2.0]})[up]
        for speed in (0.3, 1.0)
    ]
    assert weights[0] > 2.0 * weights[1]


def test_of_a_velocity_smoother_the_axis_farthest_from_nav2s_counts(scores):
    # nav2_bringup has -2.5 m/s^2 and -3.2 rad/s^2: a sixth of its turn is too weak a brake.
    down = ("velocity_smoother.max_decel", Direction.DOWN)
    weak, usual = (
        scores(Symptom.GOAL_OVERSHOOT, velocity_smoother={"max_decel": [-2.5, 0.0, turn]})[down]
        for turn in (-0.5, -3.2)
    )
    assert weak == pytest.approx(2.2 * usual)


def test_words_about_fast_turns_speak_for_slower_ones(scores):
    down = ("controller.max_vel_theta", Direction.DOWN)
    plain, told = (
        scores(Symptom.LOCALIZATION_JUMPS, words, DWB_BLOCK, DWB)[down]
        for words in ("loses its pose", "loses its pose when it turns too fast")
    )
    assert told > 1.5 * plain


@pytest.mark.parametrize(
    ("symptom", "words", "first"),
    [
        ("false_abort", "Transform data too old", "controller.transform_tolerance"),
        ("false_abort", "Controller patience exceeded", "controller_server.failure_tolerance"),
        ("false_abort", "a turn counts as being stuck", "progress_checker.plugin"),
        (
            "false_abort",
            "Timed out while waiting for action server to acknowledge goal request",
            "bt_navigator.default_server_timeout",
        ),
        ("planner_fails", "no map received", "global_costmap.map_topic"),
    ],
)
def test_a_message_of_nav2_speaks_for_its_few_causes(scores, symptom, words, first):
    found = scores(Symptom(symptom), words)
    assert max(found, key=lambda key: found[key])[0] == first
    silent = scores(Symptom(symptom))
    assert max(silent, key=lambda key: silent[key])[0] != first


def test_of_a_shim_and_another_controller_the_other_drives():
    assert kind_in("RotationShim+RPP") == "rpp"
    assert kind_in("DWA") == "dwb"
    assert kind_in("unknown") == ""
