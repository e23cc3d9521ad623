"""From causes to values in the file, and what the patched file keeps."""

from __future__ import annotations

import pytest
from doctor_texts import DWB, DWB_BLOCK, MPPI, MPPI_BLOCK, RPP, RPP_BLOCK, nav2_text

from drake_navbench.errors import InputError
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor import cures
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import Trial, scaled, told_with_step, trials_of
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.probes import size_of


@pytest.fixture
def patient(tmp_path):
    def of(text):
        path = tmp_path / "nav2.yaml"
        path.write_text(text)
        return Patient((path,), "wheelchair", {}, "jazzy")

    return of


def changes(patient, cause):
    """Returns the changes that are tried for a cause, mildest first."""
    columns = patient.columns()
    return [dict(t.changes) for t in trials_of(cause, patient.facts(), columns.setup)]


def test_a_change_of_the_outline_is_not_tried_for_it_would_change_the_robot(patient):
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace("    footprint:", "    footprint_topic:")
    round_robot = patient(text.replace("rolling_window: true", "robot_radius: 0.2"))
    with pytest.raises(InputError, match="changes the outline"):
        round_robot.before_and_after({Place("local_costmap/local_costmap", "robot_radius"): 0.3})


def test_the_costmaps_outline_is_tried_where_the_body_is_known_from_the_users_own_robot(tmp_path):
    robot = tmp_path / "mine.yaml"
    robot.write_text("description: mine\nrobot_radius: 0.2\ndrive: {type: differential}\n")
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace("    footprint:", "    footprint_topic:")
    path = tmp_path / "nav2.yaml"
    path.write_text(text.replace("rolling_window: true", "robot_radius: 0.5"))
    patient = Patient((path,), str(robot), {}, "jazzy")
    place = Place("local_costmap/local_costmap", "robot_radius")
    before, after = patient.before_and_after({place: 0.2})
    assert (before.stack.radii[0], after.stack.radii[0]) == pytest.approx((0.5, 0.2), abs=0.02)
    # Probes are made for the body of 0.2 m.
    assert size_of(before.stack, 0.5).half_width_m == pytest.approx(0.2, abs=0.005)


def test_to_look_at_the_outline_is_tried_alone_and_then_with_an_inflation_that_reaches_it(patient):
    # The outline reaches 0.46 m with its padding.
    text = nav2_text(MPPI_BLOCK, plugin=MPPI).replace("radius: 0.7", "radius: 0.4")
    cause = Cause("controller.CostCritic.consider_footprint", Direction.SET, True)
    flag = Place("controller_server", "FollowPath.CostCritic.consider_footprint")
    radius = Place("local_costmap/local_costmap", "inflation_layer.inflation_radius")
    assert changes(patient(text), cause) == [{flag: True}, {flag: True, radius: 0.51}]
    wide = nav2_text(MPPI_BLOCK, plugin=MPPI)
    assert changes(patient(wide), cause) == [{flag: True}]


def test_a_number_goes_to_the_usual_range_and_then_to_its_middle(patient):
    # The usual wz_std is 0.25 to 0.4 rad/s.
    found = changes(
        patient(nav2_text(MPPI_BLOCK | {"wz_std": 0.9}, plugin=MPPI)),
        Cause("controller.wz_std", Direction.DOWN),
    )
    place = Place("controller_server", "FollowPath.wz_std")
    assert found == [{place: 0.4}, {place: 0.325}]


@pytest.mark.parametrize(
    ("value", "steps"),
    [
        # The usual vx_std is 0.15 to 0.3 m/s, its middle 0.225: 12% more than 0.2 hardly shows.
        (0.2, [0.3, 0.32]),
        (0.16, [0.225, 0.256]),
        # From the upper end on the step is 1.6 times.
        (0.3, [0.48, 0.78]),
    ],
)
def test_a_first_step_is_far_enough_to_show(patient, value, steps):
    place = Place("controller_server", "FollowPath.vx_std")
    cause = Cause("controller.vx_std", Direction.UP)
    text = nav2_text(MPPI_BLOCK | {"vx_std": value}, plugin=MPPI)
    assert changes(patient(text), cause)[:2] == [{place: step} for step in steps]


def test_of_a_number_that_is_far_from_nav2s_that_value_is_tried_as_well(patient):
    # From 45 s the steps go to the upper end of the usual range and to its middle; Nav2 has 10 s.
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace("allowance: 20.0", "allowance: 45.0")
    place = Place("controller_server", "progress_checker.movement_time_allowance")
    down = Cause("progress_checker.movement_time_allowance", Direction.DOWN)
    assert changes(patient(text), down) == [{place: 30.0}, {place: 20.0}, {place: 10.0}]
    # In the other direction it is no cure.
    assert {place: 10.0} not in changes(patient(text), down._replace(direction=Direction.UP))


@pytest.mark.parametrize(
    ("height", "changed", "told"),
    [
        # Half the window is what the shorter side leaves, so a square one needs both.
        (5, ["height", "width"], "local_costmap.width and height to 6"),
        (8, ["width"], "local_costmap.width to 6"),
    ],
)
def test_a_window_grows_on_both_sides_unless_the_other_one_is_long_enough(
    patient, height, changed, told
):
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace("height: 5", f"height: {height}")
    found = patient(text)
    cause = Cause("local_costmap.width", Direction.UP, 6)
    first = changes(found, cause)[0]
    assert sorted(place.name for place in first) == changed
    assert {*first.values()} == {6}
    assert told in told_with_step(cause, found.facts())


def test_a_critic_is_added_to_the_list(patient):
    (found,) = changes(
        patient(nav2_text(DWB_BLOCK, plugin=DWB)),
        Cause("controller.critics", Direction.SET, "ObstacleFootprint"),
    )
    (value,) = found.values()
    assert value == [*DWB_BLOCK["critics"], "ObstacleFootprint"]


def test_a_costmaps_parameter_is_found_in_its_layer(patient):
    found = changes(
        patient(nav2_text(RPP_BLOCK, plugin=RPP)),
        Cause("local_costmap.inflation_radius", Direction.DOWN, 0.55),
    )
    place = Place("local_costmap/local_costmap", "inflation_layer.inflation_radius")
    assert found[0] == {place: 0.55}


def test_a_source_that_is_not_told_its_heights_is_told_them(patient):
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace("          max_obstacle_height: 2.0\n", "")
    found = changes(patient(text), Cause("local_costmap.max_obstacle_height", Direction.UP, 2.0))
    place = Place("local_costmap/local_costmap", "obstacle_layer.scan.max_obstacle_height")
    assert found[0] == {place: 2.0}


@pytest.mark.parametrize(
    ("share", "step"),
    [
        # From 0.9 to 0.4 rad/s is a factor of 0.444, whose root is 0.667.
        (0.5, 0.6), (1.5, 0.267),
        # 0.42 hardly differs from 0.4.
        (0.95, None),
    ],
)  # fmt: skip
def test_a_change_may_go_a_part_of_its_way_or_beyond(patient, share, step):
    facts = patient(nav2_text(MPPI_BLOCK | {"wz_std": 0.9}, plugin=MPPI)).facts()
    place = Place("controller_server", "FollowPath.wz_std")
    trial = Trial(Cause("controller.wz_std", Direction.DOWN), {place: 0.4})
    found = scaled(trial, facts, share)
    assert (found and found.changes[place]) == step


def test_the_speed_has_the_name_that_the_file_has(patient):
    old = {"desired_linear_vel": 0.5, "lookahead_dist": 0.6}
    found = changes(
        patient(nav2_text(old, plugin=RPP)), Cause("controller.max_linear_vel", Direction.DOWN)
    )
    assert {place.name for change in found for place in change} == {"FollowPath.desired_linear_vel"}


def test_a_smoother_that_lets_nothing_back_gets_half_and_then_all_of_its_speed_ahead(patient):
    smoother = {"max_velocity": [0.4, 0.0, 1.2], "min_velocity": [0.0, 0.0, -1.2]}
    back = Cause("velocity_smoother.min_velocity", Direction.DOWN)
    place = Place("velocity_smoother", "min_velocity")
    found = changes(patient(nav2_text(RPP_BLOCK, plugin=RPP, velocity_smoother=smoother)), back)
    assert found == [{place: [-0.2, 0.0, -1.2]}, {place: [-0.4, 0.0, -1.2]}]


@pytest.mark.parametrize(
    "cause",
    [
        Cause("outside.compute", Direction.DOWN),
        Cause("release", Direction.UPGRADE),
        Cause("velocity_smoother", Direction.ADD),
        Cause("controller.critics", Direction.SET),
    ],
    ids=lambda cause: cause.place,
)
def test_what_no_value_mends_is_not_tried(patient, cause):
    assert changes(patient(nav2_text(RPP_BLOCK, plugin=RPP)), cause) == []


def test_the_patched_file_keeps_comments_and_differs_in_one_line(patient):
    text = nav2_text(RPP_BLOCK, plugin=RPP).replace(
        "lookahead_dist: 0.6", "lookahead_dist: 0.6  # metres, tuned in the yard"
    )
    one = patient(text)
    place = Place("controller_server", "FollowPath.lookahead_dist")
    (after,) = one.patched_texts({place: 0.9}).values()
    assert "lookahead_dist: 0.9  # metres, tuned in the yard" in after
    changed = [a for a, b in zip(text.splitlines(), after.splitlines(), strict=True) if a != b]
    assert len(changed) == 1


def test_a_change_may_ask_for_the_speed_that_the_robots_own_file_gives(tmp_path):
    # The file asks for 0.1 m/s; the TurtleBot 4 does 0.31 m/s.
    path = tmp_path / "nav2.yaml"
    path.write_text(nav2_text(RPP_BLOCK | {"desired_linear_vel": 0.1}, plugin=RPP))
    one = Patient((path,), "turtlebot4", {}, "jazzy")
    place = Place("controller_server", "FollowPath.desired_linear_vel")
    before, after = one.before_and_after({place: 0.3})
    for preset, speed_mps in ((before, 0.1), (after, 0.3)):
        assert preset.parameters.max_linear_vel == speed_mps
        assert preset.stack.drive.max_linear_velocity_mps == 0.3
    with pytest.raises(InputError, match="asks for more speed than the file does and the robot"):
        one.before_and_after({place: 0.4})


def test_a_speed_that_the_robots_file_does_not_give_is_not_its_own(tmp_path):
    robot, path = tmp_path / "mine.yaml", tmp_path / "nav2.yaml"
    robot.write_text("description: mine\nrobot_radius: 0.2\ndrive: {type: differential}\n")
    path.write_text(nav2_text(RPP_BLOCK | {"desired_linear_vel": 0.1}, plugin=RPP))
    one = Patient((path,), str(robot), {}, "jazzy")
    with pytest.raises(InputError, match="asks for more speed"):
        one.before_and_after({Place("controller_server", "FollowPath.desired_linear_vel"): 0.3})


@pytest.mark.parametrize(
    ("cause", "told"),
    [
        (Cause("controller.wz_std", Direction.DOWN, 0.4), "lower wz_std to 0.4 rad/s"),
        (Cause("controller.batch_size", Direction.UP), "raise batch_size"),
        (Cause("goal_checker.stateful", Direction.SET, True), "set goal_checker.stateful to true"),
        (Cause("controller.critics", Direction.SET, "PathDist"), "add PathDist to critics"),
        (
            Cause("controller.inflation_cost_scaling_factor", Direction.SET),
            "set inflation_cost_scaling_factor to the value of local_costmap.cost_scaling_factor",
        ),
        (Cause("local_costmap.plugins", Direction.SET), "check and correct local_costmap.plugins"),
        (
            Cause("collision_monitor.*.min_points", Direction.UP, 4),
            "raise collision_monitor.<polygon>.min_points to 4",
        ),
        (Cause("controller.plugin", Direction.ADD), "add a rotation shim"),
        (Cause("release", Direction.UPGRADE), "upgrade to a newer release"),
    ],
    ids=lambda value: value.place if isinstance(value, Cause) else "",
)
def test_a_cure_is_an_instruction_with_the_values_unit(cause, told):
    assert cause.told == told


def test_a_cure_without_a_value_is_told_with_a_first_step(patient):
    facts = patient(nav2_text(MPPI_BLOCK | {"wz_std": 0.9}, plugin=MPPI)).facts()
    down = Cause("controller.wz_std", Direction.DOWN)
    assert told_with_step(down, facts) == "lower FollowPath.wz_std, say from 0.9 to 0.4 rad/s"
    known = down._replace(to=0.3)
    assert told_with_step(known, facts) == "lower FollowPath.wz_std to 0.3 rad/s"
    outside = Cause("outside.compute", Direction.DOWN)
    assert told_with_step(outside, facts) == outside.told


def test_a_cure_has_the_name_that_the_file_gives_unless_there_are_several(patient):
    layer = {"plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "scan"}
    one = {"plugins": ["low"], "low": layer | {"scan": {"topic": "/scan"}}}
    cause = Cause("local_costmap.topic", Direction.SET, "/front")
    facts = patient(nav2_text(MPPI_BLOCK, plugin=MPPI, local_costmap=one)).facts()
    assert told_with_step(cause, facts) == "set local_costmap.low.scan.topic to /front"
    two = one | {"plugins": ["low", "high"], "high": layer | {"scan": {"topic": "/high"}}}
    facts = patient(nav2_text(MPPI_BLOCK, plugin=MPPI, local_costmap=two)).facts()
    assert told_with_step(cause, facts) == "set local_costmap.topic to /front"


@pytest.mark.parametrize(
    ("new", "in_file", "written"),
    [(22.4, 56, 22), (0.2, 5, 0.2), (22.4, 56.0, 22.4), (0.9, 1, 1)],
)
def test_a_whole_number_stays_whole_unless_that_is_far_from_the_cure(new, in_file, written):
    assert cures._like(new, in_file) == written
    assert isinstance(cures._like(new, in_file), type(written))
